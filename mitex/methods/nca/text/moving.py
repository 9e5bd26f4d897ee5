"""The training of a look from words that moves (MeshNCA, section 5.2)."""

from __future__ import annotations

from collections.abc import Sequence

import torch

from mitex.methods.nca.motion.drift import Drift
from mitex.methods.nca.motion.pairs import Pairs, sphere_pairs
from mitex.methods.nca.motion.pool import MovingPool
from mitex.methods.nca.surfaces import TrainingSphere
from mitex.methods.nca.text.task import TextTask
from mitex.methods.nca.text.views import training_cameras


class MovingTextTask(MovingPool, TextTask):
    """Trains a look to be what words say, and to move along a vector field; arguments as of `TextTask`."""

    def pairs(self, states: Sequence[torch.Tensor], drift: Drift, generator: torch.Generator) -> Pairs:
        """In views like those that the model of texts and images sees."""
        sphere = drift.surface
        assert isinstance(sphere, TrainingSphere)
        return sphere_pairs(self.look, states, drift, training_cameras(self.config, sphere, generator))
