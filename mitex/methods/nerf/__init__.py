"""NeRF-Texture: textures with a meso-structure, captured from photos (Huang et al. 2023)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="nerf",
    title="capture a texture with its meso-structure from photos (NeRF-Texture)",
    presets="mitex.methods.nerf.config:PRESETS",
    fit="mitex.methods.nerf.cli:Fit",
    apply="mitex.methods.nerf.cli:Apply",
    texture="mitex.methods.nerf.texture:NerfTexture",
    commands={
        "capture": (
            "mitex.methods.nerf.footage.cli:MakeCapture",
            "turn a phone's video or photos into a capture",
        )
    },
)

__all__ = [
    "METHOD",
    "PRESETS",
    "Capture",
    "NerfConfig",
    "NerfTexture",
    "fit",
    "load_capture",
    "make_capture",
    "project_environment",
]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.nerf.config",
        "Capture": "mitex.methods.nerf.capture.capture",
        "NerfConfig": "mitex.methods.nerf.config",
        "NerfTexture": "mitex.methods.nerf.texture",
        "fit": "mitex.methods.nerf.fitting",
        "load_capture": "mitex.methods.nerf.capture.capture",
        "make_capture": "mitex.methods.nerf.footage.making",
        "project_environment": "mitex.methods.nerf.field.lighting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.nerf.capture.capture import Capture, load_capture
    from mitex.methods.nerf.config import PRESETS, NerfConfig
    from mitex.methods.nerf.field.lighting import project_environment
    from mitex.methods.nerf.fitting import fit
    from mitex.methods.nerf.footage.making import make_capture
    from mitex.methods.nerf.texture import NerfTexture
