"""Quilting of pictures (Efros and Freeman 2001)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="image_quilting",
    title="quilt a picture from blocks of an image, put on by UVs (compared with surface)",
    presets="mitex.methods.baselines.image_quilting.config:PRESETS",
    fit="mitex.methods.baselines.image_quilting.cli:Fit",
    apply="mitex.methods.baselines.image_quilting.cli:Apply",
    texture="mitex.methods.baselines.image_quilting.texture:QuiltedPicture",
    baseline=True,
)

__all__ = ["METHOD", "PRESETS", "QuiltingConfig", "QuiltedPicture", "fit"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.baselines.image_quilting.config",
        "QuiltingConfig": "mitex.methods.baselines.image_quilting.config",
        "QuiltedPicture": "mitex.methods.baselines.image_quilting.texture",
        "fit": "mitex.methods.baselines.image_quilting.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.baselines.image_quilting.config import PRESETS, QuiltingConfig
    from mitex.methods.baselines.image_quilting.fitting import fit
    from mitex.methods.baselines.image_quilting.texture import QuiltedPicture
