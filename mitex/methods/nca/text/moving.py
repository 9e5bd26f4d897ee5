"""The training of a look from words that moves (MeshNCA, section 5.2)."""

from __future__ import annotations

import torch

from mitex.methods.nca.config import LEAST_SIDE
from mitex.methods.nca.motion.drift import Drift
from mitex.methods.nca.motion.pool import MovingPool
from mitex.methods.nca.motion.views import MotionViews, sphere_views
from mitex.methods.nca.surfaces import TrainingSphere
from mitex.methods.nca.text.task import TextTask
from mitex.methods.nca.text.views import training_cameras


class MovingTextTask(MovingPool, TextTask):
    """Trains a look to be what words say, and to move along a vector field; arguments as of `TextTask`."""

    def motion_views(self, drift: Drift, generator: torch.Generator) -> MotionViews:
        """Like those that the vision-language model sees, as large as estimators need."""
        sphere = drift.surface
        assert isinstance(sphere, TrainingSphere)
        cameras = training_cameras(self.config, sphere, generator, LEAST_SIDE)
        return sphere_views(self.look, drift, cameras)
