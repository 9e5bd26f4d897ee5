"""Surface-aware mesh texture synthesis (Kovacs, Hermosilla and Raidou 2024)."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.methods.method import Method

METHOD = Method(
    name="surface",
    title="synthesize a texture on one mesh (tangent-space CNN)",
    presets="mitex.methods.surface.config:PRESETS",
    fit="mitex.methods.surface.cli:Fit",
    apply="mitex.methods.surface.cli:Apply",
    texture="mitex.methods.surface.texture:SurfaceTexture",
)

__all__ = ["METHOD", "PRESETS", "SurfaceConfig", "SurfaceTexture", "fit", "fit_text"]

__getattr__ = attributes(
    __name__,
    {
        "PRESETS": "mitex.methods.surface.config",
        "SurfaceConfig": "mitex.methods.surface.config",
        "SurfaceTexture": "mitex.methods.surface.texture",
        "fit": "mitex.methods.surface.fitting",
        "fit_text": "mitex.methods.surface.fitting",
    },
)

if TYPE_CHECKING:
    from mitex.methods.surface.config import PRESETS, SurfaceConfig
    from mitex.methods.surface.fitting import fit, fit_text
    from mitex.methods.surface.texture import SurfaceTexture
