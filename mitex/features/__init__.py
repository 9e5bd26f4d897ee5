"""Frozen networks that look at pictures."""

from mitex.features.layers import LAYERS
from mitex.features.normalisation import normalise_colours
from mitex.features.vgg import Vgg16

__all__ = ["LAYERS", "Vgg16", "normalise_colours"]
