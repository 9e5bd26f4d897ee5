"""Cameras, lights, and the stage that turns a mesh into a Mitsuba scene."""

from typing import TYPE_CHECKING

from mitex.lazy import attributes
from mitex.scenes.cameras import Cameras, orbit, patch_views, random_views, turntable

__all__ = ["Cameras", "mesh_shape", "orbit", "patch_views", "random_views", "turntable"]

__getattr__ = attributes(__name__, {"mesh_shape": "mitex.scenes.shapes"})

if TYPE_CHECKING:
    from mitex.scenes.shapes import mesh_shape
