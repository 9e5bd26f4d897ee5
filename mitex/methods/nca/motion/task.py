"""The training of a look that moves: the still one, along a field that differs from step to step."""

from __future__ import annotations

from collections.abc import Sequence

import torch

from mitex.methods.nca.motion.drift import Drift
from mitex.methods.nca.motion.pairs import Pairs, plane_pairs, sphere_pairs
from mitex.methods.nca.motion.pool import MovingPool
from mitex.methods.nca.surfaces import TrainingSphere
from mitex.methods.nca.task import NcaTask


class MotionTask(MovingPool, NcaTask):
    """Trains a look that moves along a vector field (MeshNCA, section 4.3); arguments as of `NcaTask`."""

    def pairs(self, states: Sequence[torch.Tensor], drift: Drift, generator: torch.Generator) -> Pairs:
        """What the estimator looks at: the widest views, in which motions are the fewest pixels."""
        surface, size = drift.surface, next(iter(self.zooms))
        if isinstance(surface, TrainingSphere):
            return sphere_pairs(self.look, states, drift, self.cameras(surface, size, generator))
        windows = surface.places(self.closeups(size), generator)
        return plane_pairs(self.look, states, drift, windows)
