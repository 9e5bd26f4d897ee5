"""The training of a look that moves: the still one, along a field that differs from step to step."""

from __future__ import annotations

import torch

from mitex.methods.nca.config import LEAST_SIDE
from mitex.methods.nca.motion.drift import Drift
from mitex.methods.nca.motion.pool import MovingPool
from mitex.methods.nca.motion.views import MotionViews, plane_views, sphere_views
from mitex.methods.nca.surfaces import TrainingSphere
from mitex.methods.nca.task import NcaTask


class MotionTask(MovingPool, NcaTask):
    """Trains a look that moves along a vector field (MeshNCA, section 4.3); arguments as of `NcaTask`."""

    def motion_views(self, drift: Drift, generator: torch.Generator) -> MotionViews:
        """The widest views, in which motions are the fewest pixels, as large as estimators need."""
        surface, size = drift.surface, next(iter(self.zooms))
        if isinstance(surface, TrainingSphere):
            return sphere_views(self.look, drift, self.cameras(surface, size, generator, LEAST_SIDE))
        return plane_views(self.look, drift, surface.places(self.closeups(size, LEAST_SIDE), generator))
