"""Boxes along the rays of photos, on planes in the place of the base shape (Huang et al. 2023, table 2)."""

from __future__ import annotations

import numpy as np

from mitex.methods.baselines.nerf_tex.instances import InstancedField
from mitex.methods.nerf.use.applied_field import AppliedField
from mitex.methods.nerf.use.on_plane import PlaneRenderer


class BoxesOnPlane(PlaneRenderer[AppliedField[InstancedField]]):
    """Renders boxes on the plane of a window, under the light of the capture.

    Args:
        field: the boxes on `plane()`, with `SCALE`.
        light: (3,) where most light of the capture comes from.
        along: (3,) direction in the scene that the plane's x follows.
    """

    def turn_light(self, turn: np.ndarray) -> None:
        self.field.field.turn_light(turn @ self.light)
