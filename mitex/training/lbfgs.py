"""L-BFGS: steps that follow the curvature of a loss without randomness."""

from collections.abc import Sequence

import torch

from mitex.training.optim import copy_state


class Lbfgs:
    """L-BFGS (Nocedal 1980) with one evaluation a step and, in place of a line search, a bound on the change.

    For losses without randomness: the curvature comes from the differences of successive gradients.

    Args:
        parameters: Tensors to update, of one type, in an order that stays the same between runs.
        memory: Pairs of steps and changes of the gradient that are kept.
    """

    def __init__(self, parameters: Sequence[torch.Tensor], memory: int = 10):
        self.parameters = list(parameters)
        self.memory = memory
        self.point = torch.cat([torch.zeros_like(p).flatten() for p in self.parameters])
        self.gradient = torch.zeros_like(self.point)
        self.steps, self.changes = (self.point.repeat(memory, 1) for _ in range(2))
        self.counts = [0, 0]  # steps done, pairs kept so far

    @torch.no_grad()
    def step(self, lr: float) -> None:
        """Updates all parameters; no element changes by more than `lr`."""
        point = torch.cat([p.flatten() for p in self.parameters])
        gradient = torch.cat(
            [(torch.zeros_like(p) if p.grad is None else p.grad).flatten() for p in self.parameters]
        )
        if self.counts[0]:
            self._keep(point - self.point, gradient - self.gradient)
        self.point.copy_(point)
        self.gradient.copy_(gradient)
        direction = self._direction(gradient)
        largest = float(direction.abs().max())
        if largest > lr or not self.counts[1]:
            direction *= lr / max(largest, torch.finfo().tiny)
        for p, part in zip(
            self.parameters, direction.split([p.numel() for p in self.parameters]), strict=True
        ):
            p.sub_(part.view_as(p))
        self.counts[0] += 1

    def _keep(self, step: torch.Tensor, change: torch.Tensor) -> None:
        """Keeps a pair if it tells of positive curvature."""
        if step @ change > 1e-6 * step.norm() * change.norm():
            place = self.counts[1] % self.memory
            self.steps[place], self.changes[place] = step, change
            self.counts[1] += 1

    def _direction(self, gradient: torch.Tensor) -> torch.Tensor:
        """The approximate inverse Hessian times the gradient, by two loops over the pairs."""
        pairs = self.counts[1]
        newest_first = [k % self.memory for k in range(pairs - 1, max(pairs - self.memory, 0) - 1, -1)]
        direction, factors = gradient.clone(), {}
        for k in newest_first:
            factors[k] = (self.steps[k] @ direction) / (self.steps[k] @ self.changes[k])
            direction -= factors[k] * self.changes[k]
        if newest_first:
            k = newest_first[0]
            direction *= (self.steps[k] @ self.changes[k]) / self.changes[k].square().sum()
        for k in reversed(newest_first):
            factor = (self.changes[k] @ direction) / (self.steps[k] @ self.changes[k])
            direction += (factors[k] - factor) * self.steps[k]
        return direction

    def clear(self) -> None:
        """Drops all gradients."""
        for p in self.parameters:
            p.grad = None

    def state(self) -> dict[str, torch.Tensor]:
        """Point, gradient and pairs: flat tensors over all parameters; `counts` (2,) int64."""
        state = {"point": self.point, "gradient": self.gradient, "steps": self.steps, "changes": self.changes}
        return state | {"counts": torch.tensor(self.counts, dtype=torch.int64)}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        """Restores what `state` returned.

        Raises:
            ValueError: It belongs to other parameters or another optimizer; nothing has been changed then.
        """
        own = self.state()
        if own.keys() != state.keys():
            raise ValueError("the state of another optimizer")
        copy_state(state, own)
        self.counts = own["counts"].tolist()
