"""A plain hash-grid radiance field (Mueller et al. 2022): the coarse density that the base shape comes from,
and what the paper compares view synthesis with."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import torch

from mitex.bridge import call
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.capture.pixels import Batch
from mitex.methods.nerf.config import RadianceConfig
from mitex.methods.nerf.field.grid_networks import GridLayout, GridNetworks, initial_parameters
from mitex.methods.nerf.field.hash_grid import HashGrid
from mitex.methods.nerf.field.occupancy import Occupancy, hull_cells
from mitex.methods.nerf.field.rendering import batch_rays, render_step
from mitex.methods.nerf.field.tensors import channels, tensor
from mitex.methods.nerf.training.radiance import RadianceTask, Rendered, schedule
from mitex.runtime.jit import dr, mi
from mitex.textures.march import Samples, sum_rays, weights_of
from mitex.training import train
from mitex.training.control import ALONE, Control
from mitex.training.locate import has_checkpoint

LEVELS, COARSEST, FINEST = 16, 16, 2048  # of the hash grid


class PlainField:
    """Density and colour of points in the scene cube, by a hash grid and two networks.

    Args:
        networks: of density and colour.
        mask, step: as `RadianceField` has them.
    """

    def __init__(self, networks: GridNetworks, mask: mi.TensorXu8, step: float) -> None:
        self.networks, self.mask, self.step = networks, mask, step

    def density_at(self, points: np.ndarray) -> np.ndarray:
        """Density [1 / scene units] of points (N, 3) in memory, (N,)."""
        return np.array(self.networks.density(channels(mi.Point3f, points))[0])

    def evaluate(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, mi.Float, mi.Color3f]:
        """As of `RadianceField`, with all points."""
        density, code = self.networks.density(points)
        return dr.arange(mi.UInt32, dr.width(points)), density, self.networks.colour(code, view)


def grid_layout(config: RadianceConfig) -> GridLayout:
    """A grid as published but for the size of its tables, and its networks."""
    return GridLayout(HashGrid(LEVELS, COARSEST, FINEST, config.table))


class PlainTask(RadianceTask[RadianceConfig]):
    """Trains a plain field; arguments as of `RadianceTask`."""

    def __init__(self, config: RadianceConfig, capture: Capture, preview_view: tuple[Capture, int]) -> None:
        self.layout = grid_layout(config)
        parameters = initial_parameters(self.layout.shapes, torch.Generator().manual_seed(config.seed))
        occupancy = Occupancy(config.occupancy, hull_cells(capture, config.occupancy))
        super().__init__(config, capture, preview_view, occupancy, parameters)

    def metadata(self) -> dict[str, str]:
        return {"method": "plain_field"} | self.pixels.capture.metadata()

    def render(self, step: int, batch: Batch, samples: Samples, generator: torch.Generator) -> Rendered:
        origin, direction = batch_rays(batch)

        def run(table: mi.TensorXf, *matrices: mi.TensorXf) -> tuple[mi.TensorXf, ...]:
            networks = GridNetworks(self.layout, table.array, matrices)
            field = PlainField(networks, self.occupancy.mask, self.step_length)
            along = dr.gather(mi.Vector3f, direction, samples.ray)
            _, density, colour = field.evaluate(samples.points(origin, direction), along)
            weights, transmittance = weights_of(density, samples)
            return tensor(sum_rays(colour * weights, samples)), tensor(transmittance), tensor(weights)

        colour, transmittance, weights = call(run, *self.named.values())
        return Rendered(colour, transmittance, weights, samples)

    def field(self, parameters: dict[str, torch.Tensor]) -> PlainField:
        networks = GridNetworks.packed(self.layout, parameters)
        return PlainField(networks, self.occupancy.mask, render_step(self.config))

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
