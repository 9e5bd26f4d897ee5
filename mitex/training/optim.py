"""Optimizers, their schedule and the gradient treatment that all methods share."""

import math
from bisect import bisect_right
from collections.abc import Callable, Iterable, Sequence
from typing import Protocol

import torch

PART = 1 << 20  # elements that are updated together on a CPU: smaller parts wake its threads too often


class Optimizer(Protocol):
    """What the loop needs of an optimizer."""

    parameters: list[torch.Tensor]

    def step(self, lr: float) -> None:
        """Updates every parameter that has a gradient."""
        ...

    def clear(self) -> None:
        """Drops all gradients."""
        ...

    def state(self) -> dict[str, torch.Tensor]:
        """What a resumed run needs."""
        ...

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        """Restores what `state` returned; ValueError if it belongs to other parameters."""
        ...


class Adam:
    """Adam (Kingma and Ba, algorithm 1), bit-equal to `torch.optim.Adam` on one device.

    Torch's own takes 1.3 s at its first use, since it loads the compiler; that would double the time to the
    first step. The moments are plain lists, which makes them easy to save.

    Args:
        parameters: Tensors to update, in an order that stays the same between runs.
        betas: Decay of the first and the second moment.
        eps: Added to the root of the second moment.
        shared: Keep one second moment for a whole tensor, the mean over its elements. Elements whose gradient
            is small and mostly noise then move little, where torch's Adam moves all alike.
    """

    def __init__(
        self,
        parameters: Sequence[torch.Tensor],
        betas: tuple[float, float] = (0.9, 0.999),
        eps: float = 1e-8,
        shared: bool = False,
    ):
        self.parameters = list(parameters)
        self.betas = betas
        self.eps = eps
        self.shared = shared
        self.first = [torch.zeros_like(p) for p in self.parameters]
        self.second = [torch.zeros_like(p.mean() if shared else p) for p in self.parameters]
        self.counts = [0] * len(self.parameters)

    @torch.no_grad()
    def step(self, lr: float) -> None:
        """Updates every parameter that has a gradient, with learning rate `lr`."""
        b1, b2 = self.betas
        for i, p in enumerate(self.parameters):
            if p.grad is None:
                continue
            self.counts[i] += 1
            n, second = self.counts[i], self.second[i]
            if self.shared:
                second.mul_(b2).add_(p.grad.square().mean(), alpha=1 - b2)
            for values, gradient, m, v in _parts(p, p.grad, self.first[i], second.expand_as(p)):
                m.lerp_(gradient, 1 - b1)
                if not self.shared:
                    v.mul_(b2).addcmul_(gradient, gradient, value=1 - b2)
                denominator = (v.sqrt() / math.sqrt(1 - b2**n)).add_(self.eps)
                values.addcdiv_(m, denominator, value=-lr / (1 - b1**n))

    def clear(self) -> None:
        """Drops all gradients."""
        for p in self.parameters:
            p.grad = None

    def state(self) -> dict[str, torch.Tensor]:
        """Moments and step counts: `first/I`, `second/I` shaped like parameter I, and `counts` (P,) int64."""
        state = {f"first/{i}": m for i, m in enumerate(self.first)}
        state |= {f"second/{i}": v for i, v in enumerate(self.second)}
        return state | {"counts": torch.tensor(self.counts, dtype=torch.int64)}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        """Restores what `state` returned.

        Raises:
            ValueError: It belongs to other parameters; nothing has been changed then.
        """
        own = self.state()
        if own.keys() != state.keys():
            raise ValueError(f"{(len(state) - 1) // 2} parameters instead of {len(self.parameters)}")
        copy_state(state, own)
        self.counts = own["counts"].tolist()


def _parts(*tensors: torch.Tensor) -> Iterable[tuple[torch.Tensor, ...]]:
    """Tensors of one shape, in parts of `PART` elements along the first axis; whole on a graphics card."""
    first = tensors[0]
    if first.numel() <= PART or not first.is_cpu:
        return [tensors]
    length = max(PART * len(first) // first.numel(), 1)
    return zip(*(tensor.split(length) for tensor in tensors), strict=True)


def copy_state(state: dict[str, torch.Tensor], own: dict[str, torch.Tensor]) -> None:
    """Copies a saved state into an optimizer's own tensors; ValueError if a shape does not fit."""
    for name, tensor in own.items():
        if tensor.shape != state[name].shape:
            actual, expected = tuple(state[name].shape), tuple(tensor.shape)
            raise ValueError(f"parameter {name.rpartition('/')[2]} has shape {actual} instead of {expected}")
    for name, tensor in own.items():
        tensor.copy_(state[name])


def multistep(lr: float, milestones: Sequence[int] = (), decay: float = 1.0) -> Callable[[int], float]:
    """The schedule `lr * decay ** (number of milestones <= step)`, as a function of the step from 0."""
    ordered = sorted(milestones)
    return lambda step: lr * decay ** bisect_right(ordered, step)


def gradient_norms(parameters: Sequence[torch.Tensor]) -> torch.Tensor:
    """L2 norm of each parameter tensor's gradient, (P,) float32; 0 where there is none."""
    norms = [
        p.new_zeros((), dtype=torch.float32) if p.grad is None else p.grad.norm().float() for p in parameters
    ]
    return torch.stack(norms).cpu()  # one transfer from a graphics card, not one for each tensor


@torch.no_grad()
def normalise_gradients(parameters: Sequence[torch.Tensor], norms: torch.Tensor | None = None) -> None:
    """Divides each parameter tensor's gradient by its own L2 norm + 1e-8, in place.

    The usual remedy for the exploding gradients of neural cellular automata: long chains of steps change a
    gradient's size by orders of magnitude, its direction less.

    Args:
        parameters: Tensors whose `grad` is scaled; those without a gradient are left alone.
        norms: Their gradient norms (P,), if they are known already.
    """
    norms = gradient_norms(parameters) if norms is None else norms
    for p, norm in zip(parameters, norms.tolist(), strict=True):
        if p.grad is not None:
            p.grad.div_(norm + 1e-8)
