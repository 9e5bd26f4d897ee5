"""`InstancedField`: a field in boxes all over a mesh, as a radiance field around it."""

from __future__ import annotations

import numpy as np
import torch

from mitex.methods.baselines.nerf_tex.boxes import Boxes
from mitex.methods.baselines.nerf_tex.networks import Evaluator, Inputs
from mitex.methods.nerf.field.occupancy import Occupancy
from mitex.methods.nerf.field.tensors import channels
from mitex.progress import announce
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.textures.march import cells_of

FINER = 2  # cells of the occupancy grid along one of the grid that finds boxes
REFRESHES = 6  # samples of the density in each cell, to find which ones are occupied


class InstancedField:
    """A `RadianceField` of boxes: each point belongs to the nearest one that it is in.

    Where boxes overlap, its density is divided by their number, as published.

    Args:
        boxes: where they are.
        evaluator: what is in them.
        occupied: (G, G, G) uint8, cells of a box's cube with matter.
        step: of rays [scene units].
        light: (3,) direction in the scene that most light comes from, of length 1.
    """

    def __init__(
        self,
        boxes: Boxes,
        evaluator: Evaluator,
        occupied: np.ndarray,
        step: float,
        light: np.ndarray,
    ) -> None:
        self.boxes, self.evaluator, self.step = boxes, evaluator, step
        self._side, self._occupied = len(occupied), upload(mi.UInt8, occupied.ravel())
        self.turn_light(light)
        touched = np.kron(boxes.touched, np.ones((FINER,) * 3, bool))
        occupancy = Occupancy(len(touched), touched)
        generator = torch.Generator().manual_seed(0)
        for sample in range(REFRESHES):
            announce("looking for what is dense", sample, REFRESHES)
            occupancy.refresh(self.density_at, generator)
        self.mask = occupancy.mask

    def turn_light(self, light: np.ndarray) -> None:
        """Lets most light come from another direction (3,)."""
        self._light = np.asarray(light, np.float32)

    def evaluate(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, mi.Float, mi.Color3f]:
        """As of `RadianceField`."""
        box, overlaps, local = self.boxes.nearest(points)
        cell = cells_of(local, self._side)
        filled = dr.gather(mi.UInt8, self._occupied, cell, overlaps > 0) != 0
        index = mi.UInt32(dr.compress((overlaps > 0) & filled))
        if not dr.width(index):
            return mi.UInt32(), mi.Float(), mi.Color3f()
        box, overlaps = (dr.gather(mi.UInt32, values, index) for values in (box, overlaps))
        along = self.boxes.inside(box, dr.gather(mi.Vector3f, view, index))
        # Anew each time: a zero in it can become as wide as what it was multiplied with.
        light = self.boxes.inside(box, mi.Vector3f(self._light.tolist()))
        density, colour = self.evaluator(Inputs(dr.gather(mi.Point3f, local, index), along, light))
        return index, density / (self.boxes.half * mi.Float(overlaps)), colour

    def density_at(self, points: np.ndarray) -> np.ndarray:
        """Density [1 / scene units] of points (N, 3) in memory, (N,)."""
        index, density, _ = self.evaluate(
            channels(mi.Point3f, points), dr.full(mi.Vector3f, 0.0, len(points))
        )
        result = np.zeros(len(points), np.float32)
        result[np.array(index)] = np.array(density)
        return result
