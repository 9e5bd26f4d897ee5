"""The training of a look from words that moves (MeshNCA, section 5.2)."""

from __future__ import annotations

import torch

from mitex.methods.nca.config import LEAST_SIDE
from mitex.methods.nca.motion.pool import MovingPool
from mitex.methods.nca.motion.tangent_field import TangentField
from mitex.methods.nca.motion.views import MotionViews, mesh_views
from mitex.methods.nca.surfaces import TrainingMesh
from mitex.methods.nca.text.task import TextTask
from mitex.methods.nca.text.views import training_cameras


class MovingTextTask(MovingPool, TextTask):
    """Trains a look to be what words say, and to move along a vector field; arguments as of `TextTask`."""

    def motion_views(self, field: TangentField, generator: torch.Generator) -> MotionViews:
        """Like those that the vision-language model sees, as large as estimators need."""
        surface = field.surface
        assert isinstance(surface, TrainingMesh)
        cameras = training_cameras(self.config, surface, generator, LEAST_SIDE)
        return mesh_views(self.look, field, cameras)
