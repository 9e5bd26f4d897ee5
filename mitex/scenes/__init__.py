"""Cameras, lights, and the stage that turns a mesh into a Mitsuba scene."""

from mitex.scenes.cameras import Cameras, orbit, patch_views, random_views, turntable

__all__ = ["Cameras", "orbit", "patch_views", "random_views", "turntable"]
