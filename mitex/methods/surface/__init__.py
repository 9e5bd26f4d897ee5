"""Surface-aware mesh texture synthesis (Kovacs, Hermosilla and Raidou 2024)."""

from mitex.methods.surface.config import PRESETS, SurfaceConfig
from mitex.methods.surface.fit import fit
from mitex.methods.surface.texture import SurfaceTexture

__all__ = ["PRESETS", "SurfaceConfig", "SurfaceTexture", "fit"]
