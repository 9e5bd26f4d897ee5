"""A plain hash-grid radiance field (Mueller et al. 2022): the coarse density that the base shape comes from,
and what the paper compares view synthesis with."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path

import numpy as np
import torch

from mitex.bridge import call
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.capture.pixels import Batch
from mitex.methods.nerf.config import RadianceConfig
from mitex.methods.nerf.field.decoder import HIGHEST, sigmoid
from mitex.methods.nerf.field.hash_grid import HashGrid
from mitex.methods.nerf.field.mlp import network_rows, packed_networks, weight_bound
from mitex.methods.nerf.field.occupancy import Occupancy, hull_cells
from mitex.methods.nerf.field.rendering import batch_rays, render_step
from mitex.methods.nerf.field.tensors import channels, tensor
from mitex.methods.nerf.training.radiance import RadianceTask, Rendered, schedule
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.textures.march import Samples, sum_rays, weights_of
from mitex.training import train
from mitex.training.control import ALONE, Control
from mitex.training.locate import has_checkpoint

LEVELS, COARSEST, FINEST = 16, 16, 2048  # of the hash grid
CODE = 15  # channels that the density network hands to that of the colour
DENSITY, COLOUR = (2 * LEVELS, 64, CODE + 1), (CODE + 16, 64, 64, 3)  # widths of the networks' layers


class PlainField:
    """Density and colour of points in the scene cube, by a hash grid and two networks.

    Args:
        grid: of features.
        table: its values, flat.
        weights: matrices (out, in) of the density network and of that of the colour.
        mask, step: as `RadianceField` has them.
        packed: evaluate as cooperative vectors, which is faster but has no derivatives.
    """

    def __init__(
        self,
        grid: HashGrid,
        table: mi.Float,
        weights: Sequence[mi.TensorXf],
        mask: mi.TensorXu8,
        step: float,
        packed: bool = False,
    ) -> None:
        self.grid, self.table = grid, table
        remaining = iter(weights)
        nets = [[next(remaining) for _ in widths[1:]] for widths in (DENSITY, COLOUR)]
        self._nets = packed_networks(*nets) if packed else nets
        self.mask, self.step = mask, step

    @staticmethod
    def of(
        parameters: Mapping[str, torch.Tensor], grid: HashGrid, mask: mi.TensorXu8, step: float
    ) -> PlainField:
        """The field of a table and matrices in the order of `parameter_shapes`, packed."""
        table, *weights = (upload(mi.TensorXf, value.detach().numpy()) for value in parameters.values())
        return PlainField(grid, table.array, weights, mask, step, packed=True)

    def density(self, points: mi.Point3f) -> tuple[mi.Float, list[mi.Float]]:
        """Density [1 / scene units] of points in the scene cube, and a code for the colour (15 arrays)."""
        exponent, *code = network_rows(self._nets[0], self.grid(points, self.table))
        return dr.exp(dr.minimum(exponent, HIGHEST)), code

    def density_at(self, points: np.ndarray) -> np.ndarray:
        """The same of points (N, 3) in memory, (N,)."""
        return np.array(self.density(channels(mi.Point3f, points))[0])

    def colour(self, code: Sequence[mi.Float], view: mi.Vector3f) -> mi.Color3f:
        """Display values in [0, 1] for codes, seen along rays in the unit directions `view`."""
        rows = network_rows(self._nets[1], [*code, *dr.sh_eval(view, 3)])
        return mi.Color3f(*(sigmoid(row) for row in rows))

    def evaluate(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, mi.Float, mi.Color3f]:
        """As of `RadianceField`, with all points."""
        density, code = self.density(points)
        return dr.arange(mi.UInt32, dr.width(points)), density, self.colour(code, view)


def hash_grid(config: RadianceConfig) -> HashGrid:
    """The grid of the features, as published but for the size of its tables."""
    return HashGrid(LEVELS, COARSEST, FINEST, config.table)


def parameter_shapes(grid: HashGrid) -> dict[str, tuple[int, ...]]:
    """Shapes of what is learned, by name: the grid's table, and the matrices of both networks."""
    layers = [(o, i) for w in (DENSITY, COLOUR) for i, o in zip(w[:-1], w[1:], strict=True)]
    return {"table": (grid.size,)} | {f"weights/{k}": shape for k, shape in enumerate(layers)}


class PlainTask(RadianceTask[RadianceConfig]):
    """Trains a plain field; arguments as of `RadianceTask`."""

    def __init__(self, config: RadianceConfig, capture: Capture, preview_view: tuple[Capture, int]) -> None:
        generator = torch.Generator().manual_seed(config.seed)
        self.grid = hash_grid(config)
        parameters = {}
        for name, shape in parameter_shapes(self.grid).items():
            bound = 1e-4 if name == "table" else weight_bound((shape[0], shape[-1]))
            parameters[name] = torch.empty(shape).uniform_(-bound, bound, generator=generator)
            parameters[name].requires_grad_()
        occupancy = Occupancy(config.occupancy, hull_cells(capture, config.occupancy))
        super().__init__(config, capture, preview_view, occupancy, parameters)

    def metadata(self) -> dict[str, str]:
        return {"method": "plain_field"} | self.pixels.capture.metadata()

    def render(self, step: int, batch: Batch, samples: Samples, generator: torch.Generator) -> Rendered:
        origin, direction = batch_rays(batch)

        def run(table: mi.TensorXf, *matrices: mi.TensorXf) -> tuple[mi.TensorXf, ...]:
            field = PlainField(self.grid, table.array, matrices, self.occupancy.mask, self.step_length)
            along = dr.gather(mi.Vector3f, direction, samples.ray)
            _, density, colour = field.evaluate(samples.points(origin, direction), along)
            weights, transmittance = weights_of(density, samples)
            return tensor(sum_rays(colour * weights, samples)), tensor(transmittance), tensor(weights)

        colour, transmittance, weights = call(run, *self.named.values())
        return Rendered(colour, transmittance, weights, samples)

    def field(self, parameters: dict[str, torch.Tensor]) -> PlainField:
        return PlainField.of(parameters, self.grid, self.occupancy.mask, render_step(self.config))

    def density(self, points: np.ndarray) -> np.ndarray:
        return self.field(self.named).density_at(points)


def train_plain_field(
    config: RadianceConfig,
    capture: Capture,
    preview_view: tuple[Capture, int],
    folder: Path | None = None,
    control: Control = ALONE,
) -> PlainTask:
    """Trains a plain field, in a run folder, where a training is continued, or in memory.

    Arguments are those of `RadianceTask` and of `train`.
    """
    task = PlainTask(config, capture, preview_view)
    resume = folder is not None and has_checkpoint(folder)
    train(task, config, folder, resume=resume, control=control, **schedule(config))
    return task
