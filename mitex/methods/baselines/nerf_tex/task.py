"""What one training step of a box does."""

from __future__ import annotations

import numpy as np
import torch

from mitex.bridge import call
from mitex.methods.baselines.nerf_tex import METHOD
from mitex.methods.baselines.nerf_tex.config import NerfTexConfig
from mitex.methods.baselines.nerf_tex.field import BoxField
from mitex.methods.baselines.nerf_tex.networks import Inputs, network_of
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.capture.pixels import Batch
from mitex.methods.nerf.field.occupancy import Occupancy
from mitex.methods.nerf.field.rendering import batch_rays, render_step
from mitex.methods.nerf.field.tensors import channels, tensor
from mitex.methods.nerf.training.radiance import RadianceTask, Rendered
from mitex.runtime.jit import dr, mi
from mitex.textures.march import Samples, sum_rays, weights_of

DARK = 1e-2  # added to the sum of both values that a relative difference is taken of


class BoxTask(RadianceTask[NerfTexConfig]):
    """Trains a field to look like a box.

    What differs from the publication in the preset `paper`, too: the rays of a step are of all pictures, not
    256 of each of four; places along a ray are 1/256 of the cube's diagonal apart and jittered together, not
    256 between where it enters and leaves, each by itself; empty cells are left out; Adam's moments decay as
    for the other radiance fields. And where boxes are put on a mesh: published normals are jittered, here
    boxes stand upright unless `tilt` makes them lean.

    Args:
        config: settings.
        pictures: of the box, in its cube.
        lights: (N, 3) where most light of each comes from.
        possible: cells of the cube that the piece may touch.
    """

    def __init__(
        self, config: NerfTexConfig, pictures: Capture, lights: np.ndarray, possible: np.ndarray
    ) -> None:
        self.network = network_of(config)
        held_out = np.arange(len(pictures)) % 8 == 0
        self.lights, self.preview_light = lights[~held_out], lights[0]
        training, test = pictures.split()
        parameters = self.network.initial(torch.Generator().manual_seed(config.seed))
        occupancy = Occupancy(config.occupancy, possible)
        super().__init__(config, training, (test, 0), occupancy, parameters)

    def metadata(self) -> dict[str, str]:
        return {"method": METHOD.name} | self.pixels.capture.metadata()

    def render(self, step: int, batch: Batch, samples: Samples, generator: torch.Generator) -> Rendered:
        rays = batch_rays(batch)
        along = dr.gather(mi.Vector3f, rays[1], samples.ray)
        light = dr.gather(mi.Vector3f, channels(mi.Vector3f, self.lights[batch.view]), samples.ray)
        density, colour = self.network.attached(self.named, Inputs(samples.points(*rays), along, light))

        def run(density: mi.TensorXf, colour: mi.TensorXf) -> tuple[mi.TensorXf, ...]:
            weights, transmittance = weights_of(density.array, samples)
            display = dr.unravel(mi.Color3f, colour.array)
            return tensor(sum_rays(display * weights, samples)), tensor(transmittance), tensor(weights)

        colours, transmittance, weights = call(run, density, colour)
        return Rendered(colours, transmittance, weights, samples)

    def error(self, rendered: Rendered, batch: Batch, background: torch.Tensor) -> torch.Tensor:
        """Relative difference of colours where there is something, and squared one of opacity
        (Baatz et al. 2022)."""
        colours, target = rendered.colour, batch.colours * batch.alpha
        relative = self.magnitude((colours - target) / (colours.abs() + target + DARK))
        opacity = (1 - rendered.transmittance - batch.alpha[:, 0]).square().mean()
        return relative[batch.alpha[:, 0] > 0].sum() / max(int((batch.alpha > 0).sum()) * 3, 1) + opacity

    def field(self, parameters: dict[str, torch.Tensor]) -> BoxField:
        evaluator = self.network.evaluator(parameters)
        return BoxField(evaluator, self.occupancy.mask, render_step(self.config), self.preview_light)

    def density(self, points: np.ndarray) -> np.ndarray:
        return self.field(self.named).density_at(points)
