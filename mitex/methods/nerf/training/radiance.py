"""Training a radiance field on a capture: what the textured shell and the plain field share (section 3.3)."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from functools import partial
from typing import Generic, TypedDict, TypeVar

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.capture.pixels import Batch, Pixels
from mitex.methods.nerf.config import RadianceConfig
from mitex.methods.nerf.field.occupancy import Occupancy
from mitex.methods.nerf.field.rendering import batch_rays, render_view
from mitex.methods.nerf.field.tensors import rows
from mitex.methods.nerf.training.losses import distortion
from mitex.runtime import lower_worker_priority
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.textures.march import DIAGONAL, RadianceField, Samples, march, visible
from mitex.training import Change, Step
from mitex.training.optim import Adam, Optimizer

REFRESH = 16  # steps between refreshes of the occupancy, and between updates of the mean parameters
BETAS, EPSILON = (0.9, 0.99), 1e-15  # of Adam
L2_WEIGHT = 5.0  # a difference of 0.1, as is usual, has the slope that it has in L1
PREVIEW = 160  # pixels along the longest side

Config = TypeVar("Config", bound=RadianceConfig)


class RadianceTask(ABC, Generic[Config]):
    """A radiance field as a task of the training loop; the parameters that are kept are their running mean.

    Args:
        config: settings.
        capture: views to learn from.
        preview_view: a view for previews, held out or not, as (capture, index).
        occupancy: which cells may hold matter.
        parameters: leaf tensors by name.
    """

    def __init__(
        self,
        config: Config,
        capture: Capture,
        preview_view: tuple[Capture, int],
        occupancy: Occupancy,
        parameters: dict[str, torch.Tensor],
    ) -> None:
        self.config, self.occupancy = config, occupancy
        self.pixels = Pixels(capture)
        self.preview_view = preview_view
        self.named = parameters
        self.mean = {name: value.detach().clone() for name, value in parameters.items()}
        self.step_length = DIAGONAL / config.ray_steps
        self._commits = 0
        dr.set_expand_threshold(2**26)  # by default gradients of large tables are 2.5 times slower
        lower_worker_priority()

    @abstractmethod
    def metadata(self) -> dict[str, str]:
        """What a checkpoint tells of the run that it belongs to."""

    def with_cameras(self, batch: Batch) -> Batch:
        """The batch with rays of the refined cameras."""
        return batch

    @abstractmethod
    def render(self, step: int, batch: Batch, samples: Samples, generator: torch.Generator) -> Rendered:
        """Composites the samples of a batch's rays, attached to the parameters."""

    @abstractmethod
    def field(self, parameters: dict[str, torch.Tensor]) -> RadianceField:
        """The field as it is with these parameters, for marching without derivatives."""

    @abstractmethod
    def density(self, points: np.ndarray) -> np.ndarray:
        """Density (N,) [1 / scene units] of points (N, 3) of the scene cube, with the current parameters."""

    @property
    def parameters(self) -> Sequence[torch.Tensor]:
        return list(self.named.values())

    def begin(self, step: int, generator: torch.Generator) -> Change | None:
        """Refreshes the occupancy, every `REFRESH` steps."""
        if step % REFRESH:
            return None
        undo = partial(self.occupancy.load_state, self.occupancy.state())
        return Change(undo, {"density": self.occupancy.refresh(self.density, generator)})

    def loss(self, step: int, generator: torch.Generator) -> Step:
        """The error of rays before a random background, and the field's own terms.

        Raises:
            ConfigError: nothing is left of the field.
        """
        batch = self.with_cameras(self._draw(step, generator))
        jitter = torch.rand(len(batch.view), generator=generator)
        rays = batch_rays(batch)
        samples = march(*rays, self.occupancy.mask, self.step_length, upload(mi.Float, jitter.numpy()))
        background = torch.rand(batch.colours.shape, generator=generator)
        if not len(samples):
            return self._unseen(batch, background)
        samples = visible(samples, *rays, lambda points: upload(mi.Float, self.density(rows(points))))
        rendered = self.render(step, batch, samples, generator)
        rendered.average(batch.pixel_mean)
        error = self.error(rendered, batch, background)
        total = error + sum(rendered.terms.values())
        if self.config.distortion:
            widths = torch.full_like(rendered.t, self.step_length)
            spread = distortion(rendered.weights, rendered.t, widths, rendered.ray)
            total = total + self.config.distortion * spread
        metrics = {
            "colour": error.item(),
            "samples": float(len(rendered.t)),
            "occupied": self.occupancy.share,
        }
        metrics |= {name: value.item() for name, value in rendered.terms.items()}
        return Step(total, metrics, self._average)

    def _unseen(self, batch: Batch, background: torch.Tensor) -> Step:
        """A step whose rays pass through empty space alone, from which nothing is learned."""
        if not self.occupancy.share:
            raise ConfigError(
                "the field has become empty",
                "lower `lr`, and see that the masks show the object, not its ground",
            )
        error = self.magnitude((background - batch.colours) * batch.alpha).mean()
        still = sum((0.0 * value.sum() for value in self.parameters), torch.zeros(()))
        metrics = {"colour": error.item(), "samples": 0.0, "occupied": self.occupancy.share}
        return Step(error + still, metrics, self._average)

    def error(self, rendered: Rendered, batch: Batch, background: torch.Tensor) -> torch.Tensor:
        """How far the means of rays are from their pixels: of colours before a background (P, 3)."""
        colour = rendered.colour + rendered.transmittance[:, None] * background
        target = batch.colours * batch.alpha + background * (1 - batch.alpha)
        return self.magnitude(colour - target).mean()

    def magnitude(self, differences: torch.Tensor) -> torch.Tensor:
        """How much differences of colours (N, 3) count, (N, 3)."""
        if self.config.colour_loss == "l1":
            return differences.abs()
        return L2_WEIGHT * differences.square()

    def is_late(self, step: int) -> bool:
        """Whether the learning rate has gone half of its way to a tenth.

        `steps` has no say, or a run that goes on for more steps would not be that of one go.
        """
        return 2 * step >= self.config.lr_steps

    def _draw(self, step: int, generator: torch.Generator) -> Batch:
        """Rays of a step: early single ones, since many pixels teach more than pixels that are exact."""
        config = self.config
        across = config.rays_across if self.is_late(step) else 1
        return self.pixels.draw(config.rays, config.one_view, generator, across)

    def _average(self) -> None:
        """Every `REFRESH` updates the mean parameters move towards the current ones."""
        self._commits += 1
        if self._commits % REFRESH:
            return
        with torch.no_grad():
            for name, value in self.named.items():
                self.mean[name].lerp_(value, 1 - self.config.average)

    def state(self) -> dict[str, torch.Tensor]:
        state = {f"parameters/{name}": value.detach() for name, value in self.named.items()}
        state |= {f"mean/{name}": value for name, value in self.mean.items()}
        return state | self.occupancy.state() | {"commits": torch.tensor(self._commits)}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        with torch.no_grad():
            for name, value in self.named.items():
                value.copy_(state[f"parameters/{name}"])
                self.mean[name].copy_(state[f"mean/{name}"])
        self.occupancy.load_state(state)
        self._commits = int(state["commits"])

    def preview(self, step: int) -> np.ndarray:
        """A photo, and the same view of the field, on white."""
        return np.hstack(render_view(self.field(self.mean), *self.preview_view, PREVIEW)[::-1])


class Schedule(TypedDict):
    """Options of `train` that all radiance fields are trained with."""

    lr: Callable[[int], float]
    optimizer: Callable[[Sequence[torch.Tensor]], Optimizer]


def schedule(config: RadianceConfig) -> Schedule:
    """Adam with a learning rate that falls to a tenth in `lr_steps`."""
    return {
        "lr": lambda step: config.lr * 0.1 ** (step / config.lr_steps),
        "optimizer": partial(Adam, betas=BETAS, eps=EPSILON),
    }


class Rendered:
    """R rays composited from M samples, as tensors.

    Attributes:
        colour: (R, 3) in display values, times opacity.
        transmittance: (R,) in [0, 1].
        weights, t: (M,) compositing weight of each sample, and its distance along the ray [scene units].
        ray: (M,) int64.
        terms: further losses by name, weighted; none at first.

    Args:
        colour, transmittance, weights: see above.
        samples: the M samples.
    """

    def __init__(
        self, colour: torch.Tensor, transmittance: torch.Tensor, weights: torch.Tensor, samples: Samples
    ) -> None:
        self.colour, self.transmittance, self.weights = colour, transmittance, weights
        self.t = torch.from_numpy(np.array(samples.t))
        self.ray = torch.from_numpy(np.array(samples.ray).astype(np.int64))
        self.terms: dict[str, torch.Tensor] = {}

    def average(self, pixel_mean: Callable[[torch.Tensor], torch.Tensor]) -> None:
        """Puts means over the rays of each pixel in the place of the rays' colours and transmittances."""
        self.colour, self.transmittance = pixel_mean(self.colour), pixel_mean(self.transmittance)
