"""Path-traced pictures of assets: stills, turntables, contact sheets."""

from mitex.render.picture import STILL_SUFFIXES, VIDEO_SUFFIXES, render_still, still, tone, turntable
from mitex.render.renderer import OrbitRenderer
from mitex.render.sheet import sheet

__all__ = [
    "STILL_SUFFIXES",
    "VIDEO_SUFFIXES",
    "OrbitRenderer",
    "render_still",
    "sheet",
    "still",
    "tone",
    "turntable",
]
