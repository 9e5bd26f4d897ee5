"""Training a radiance field on a capture: what the textured shell and the plain field share (section 3.3)."""

from __future__ import annotations

import math
from abc import ABC, abstractmethod
from collections.abc import Sequence
from functools import partial
from typing import Any

import numpy as np
import torch

from mitex.integrators.march import DIAGONAL, RadianceField, Samples, march, traverse, visible
from mitex.methods.nerf.capture import Capture
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.losses import distortion
from mitex.methods.nerf.occupancy import Occupancy
from mitex.methods.nerf.pixels import Batch, Pixels
from mitex.methods.nerf.tensors import channels, rows
from mitex.runtime import load_mitsuba, modest_workers
from mitex.training.optim import Adam

mi: Any = load_mitsuba(needs_llvm=False)
import drjit as dr  # noqa: E402  (Mitsuba first: it decides which LLVM Dr.Jit opens)

REFRESH = 16  # steps between looks at the occupancy, and between updates of the mean parameters
BETAS, EPSILON = (0.9, 0.99), 1e-15  # of Adam
PREVIEW = 160  # pixels along the longest side
CHUNK = 1 << 16  # rays marched at a time
FINER = 2  # steps of a look for one of the training; the durian gains 0.4 dB by it, and none by training so


def look_step(config: NerfConfig) -> float:
    """Length of the steps in which a trained field is looked at [scene units]."""
    return DIAGONAL / (FINER * config.cells)


class RadianceTask(ABC):
    """A radiance field as a task of the training loop; the parameters that are kept are their running mean.

    Args:
        config: settings.
        capture: views to learn from.
        shown: a view of it for previews, held out or not, as (capture, index).
        occupancy: which cells may hold matter.
        parameters: leaf tensors by name.
    """

    def __init__(
        self,
        config: NerfConfig,
        capture: Capture,
        shown: tuple[Capture, int],
        occupancy: Occupancy,
        parameters: dict[str, torch.Tensor],
    ) -> None:
        self.config, self.occupancy = config, occupancy
        self.pixels = Pixels(capture)
        self.shown = shown
        self.named = parameters
        self.mean = {name: value.detach().clone() for name, value in parameters.items()}
        self.step_length = DIAGONAL / config.cells
        self._commits = 0
        dr.set_expand_threshold(2**26)  # by default gradients of large tables are 2.5 times slower
        modest_workers()

    @abstractmethod
    def metadata(self) -> dict[str, str]:
        """What checkpoints tell."""

    def aimed(self, batch: Batch) -> Batch:
        """The batch with its cameras as they are now known."""
        return batch

    @abstractmethod
    def render(self, step: int, batch: Batch, samples: Samples, generator: torch.Generator) -> Rendered:
        """What the rays of a batch gather from their samples, attached to the parameters."""

    @abstractmethod
    def field(self, parameters: dict[str, torch.Tensor]) -> RadianceField:
        """The field as it is with these parameters, for marching without derivatives."""

    @abstractmethod
    def density(self, points: np.ndarray) -> np.ndarray:
        """Density (N,) of points (N, 3) with the parameters of now."""

    @property
    def parameters(self) -> Sequence[torch.Tensor]:
        return list(self.named.values())

    def loss(self, step: int, generator: torch.Generator) -> tuple[torch.Tensor, dict[str, float]]:
        """L1 of colours before a random background, and the field's own terms."""
        if step % REFRESH == 0:
            self.occupancy.refresh(self.density, generator)
        batch = self.aimed(self.pixels.draw(self.config.rays, self.config.one_view, generator))
        jitter = torch.rand(len(batch.view), generator=generator)
        rays = rays_of(batch)
        samples = march(*rays, self.occupancy.mask, self.step_length, mi.Float(jitter.numpy()))
        background = torch.rand(batch.colours.shape, generator=generator)
        wanted = batch.colours * batch.alpha + background * (1 - batch.alpha)
        if not len(samples):
            raise ValueError("no ray meets an occupied cell")
        samples = visible(samples, *rays, lambda points: mi.Float(self.density(rows(points))))
        made = self.render(step, batch, samples, generator)
        picture = made.colour + made.through[:, None] * background
        error = (picture - wanted).abs().mean()
        total = error + sum(made.terms.values())
        if self.config.distortion:
            widths = torch.full_like(made.t, self.step_length)
            spread = distortion(made.weights, made.t, widths, made.ray)
            total = total + self.config.distortion * spread
        record = {"colour": error.item(), "samples": float(len(made.t)), "occupied": self.occupancy.share}
        return total, record | {name: value.item() for name, value in made.terms.items()}

    def commit(self) -> None:
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
        batch, shape = Pixels(self.shown[0]).image(self.shown[1], PREVIEW)
        photo = (batch.colours * batch.alpha + 1 - batch.alpha).numpy().reshape(*shape, 3)
        return np.hstack([photo, self.picture(batch).reshape(*shape, 3)])

    def picture(self, batch: Batch) -> np.ndarray:
        """Colours (R, 3) of rays on white, in [0, 1], with the mean parameters."""
        return look(self.field(self.mean), batch)


def schedule(config: NerfConfig) -> dict[str, Any]:
    """Options of `train`: Adam with a learning rate that falls to a tenth in `lr_steps`."""
    return {
        "lr": lambda step: config.lr * 0.1 ** (step / config.lr_steps),
        "optimizer": partial(Adam, betas=BETAS, eps=EPSILON),
    }


class Rendered:
    """What a batch of R rays gathered from M samples, as tensors.

    Attributes:
        colour: (R, 3) in display values, times opacity.
        through: (R,) what passes.
        weights, t: (M,) share of each sample in its ray, and its place [scene units].
        ray: (M,) int64.
        terms: further losses, weighted.
    """

    def __init__(
        self,
        colour: torch.Tensor,
        through: torch.Tensor,
        weights: torch.Tensor,
        samples: Samples,
        terms: dict[str, torch.Tensor] | None = None,
    ) -> None:
        self.colour, self.through, self.weights = colour, through, weights
        self.t = torch.from_numpy(np.array(samples.t))
        self.ray = torch.from_numpy(np.array(samples.ray).astype(np.int64))
        self.terms = terms or {}


def rays_of(batch: Batch) -> tuple[Any, Any]:
    """Origins and directions as Dr.Jit arrays."""
    return channels(mi.Point3f, batch.origins), channels(mi.Vector3f, batch.directions)


def look(field: RadianceField, batch: Batch) -> np.ndarray:
    """Colours (R, 3) of the batch's rays through a field, on white, display values in [0, 1]."""
    colour, through = seen(field, batch.origins, batch.directions)
    return np.clip(colour + through[:, None], 0, 1)


def seen(
    field: RadianceField, origins: np.ndarray, directions: np.ndarray, far: float = math.inf
) -> tuple[np.ndarray, np.ndarray]:
    """What R rays meet in a field.

    Args:
        field: in its cube.
        origins, directions: (R, 3), directions of length 1.
        far: where they end [scene units].

    Returns:
        Colours (R, 3) times opacity, and what passes (R,).
    """
    colours, through = [np.zeros((0, 3), np.float32)], [np.zeros(0, np.float32)]
    for start in range(0, len(origins), CHUNK):
        part = slice(start, start + CHUNK)
        origin, direction = channels(mi.Point3f, origins[part]), channels(mi.Vector3f, directions[part])
        found = traverse(field, origin, direction, dr.full(mi.Float, 0.5, dr.width(origin)), far)
        colours.append(rows(found.colour))
        through.append(np.array(found.through))
    return np.concatenate(colours), np.concatenate(through)
