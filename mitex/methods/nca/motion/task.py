"""The training of a look that moves: the still one, along a field that differs from step to step."""

from __future__ import annotations

import torch

from mitex.methods.nca.config import LEAST_SIDE
from mitex.methods.nca.motion.pool import MovingPool
from mitex.methods.nca.motion.tangent_field import TangentField
from mitex.methods.nca.motion.views import MotionViews, mesh_views, plane_views
from mitex.methods.nca.surfaces import TrainingMesh
from mitex.methods.nca.task import NcaTask


class MotionTask(MovingPool, NcaTask):
    """Trains a look that moves along a vector field (MeshNCA, section 4.3); arguments as of `NcaTask`."""

    def motion_views(self, field: TangentField, generator: torch.Generator) -> MotionViews:
        """The widest views, in which motions are the fewest pixels, as large as estimators need."""
        surface, size = field.surface, next(iter(self.zooms))
        if isinstance(surface, TrainingMesh):
            return mesh_views(self.look, field, self.cameras(surface, size, generator, LEAST_SIDE))
        return plane_views(self.look, field, surface.places(self.closeups(size, LEAST_SIDE), generator))
