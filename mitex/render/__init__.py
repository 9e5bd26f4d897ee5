"""Path-traced pictures of assets: stills, turntables, films, contact sheets."""

from mitex.render.film import film
from mitex.render.picture import STILL_SUFFIXES, render_still, still, tone, turntable
from mitex.render.renderer import OrbitRenderer
from mitex.render.sheet import sheet
from mitex.render.video import VIDEO_SUFFIXES, check_video

__all__ = [
    "STILL_SUFFIXES",
    "VIDEO_SUFFIXES",
    "OrbitRenderer",
    "check_video",
    "film",
    "render_still",
    "sheet",
    "still",
    "tone",
    "turntable",
]
