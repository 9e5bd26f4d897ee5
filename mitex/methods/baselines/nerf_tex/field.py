"""A box by itself: the radiance field in its cube, under a light from one direction."""

from __future__ import annotations

import numpy as np

from mitex.methods.baselines.nerf_tex.networks import Evaluator, Inputs
from mitex.methods.nerf.field.tensors import channels
from mitex.runtime.jit import dr, mi


class BoxField:
    """What a network has learned of a box, as a `RadianceField`.

    Args:
        evaluator: of the network.
        mask, step: as `RadianceField` has them.
        light: (3,) where most light comes from, of length 1.
    """

    def __init__(self, evaluator: Evaluator, mask: mi.TensorXu8, step: float, light: np.ndarray) -> None:
        self.evaluator, self.mask, self.step = evaluator, mask, step
        self.light = np.asarray(light, np.float32)

    def evaluate(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, mi.Float, mi.Color3f]:
        """As of `RadianceField`, with all points."""
        count = dr.width(points)
        light = mi.Vector3f(*(dr.full(mi.Float, value, count) for value in self.light.tolist()))
        density, colour = self.evaluator(Inputs(points, view, light))
        return dr.arange(mi.UInt32, count), density, colour

    def density_at(self, points: np.ndarray) -> np.ndarray:
        """Density [1 / units of the box] of points (N, 3) in memory, (N,)."""
        view = dr.full(mi.Vector3f, 0.0, len(points))
        return np.array(self.evaluate(channels(mi.Point3f, points), view)[1])
