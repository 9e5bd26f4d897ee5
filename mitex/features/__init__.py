"""Frozen networks that look at pictures."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes

__all__ = ["LAYERS", "Vgg16", "normalise_colours"]

__getattr__ = attributes(
    __name__,
    {
        "LAYERS": "mitex.features.layers",
        "Vgg16": "mitex.features.vgg",
        "normalise_colours": "mitex.features.normalisation",
    },
)

if TYPE_CHECKING:
    from mitex.features.layers import LAYERS
    from mitex.features.normalisation import normalise_colours
    from mitex.features.vgg import Vgg16
