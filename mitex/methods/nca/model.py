"""Mesh neural cellular automata: the model (Pajouheshgar et al. 2024, section 3.2)."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import torch
import torch.nn.functional as F
from torch import nn

from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.methods.nca import dense
from mitex.methods.nca.perception import HARMONICS, Perception, perception

FIRE_RATE = 0.5  # probability that a cell updates in a step (equation 3)


class MeshNCA(nn.Module):
    """The cell rule: perception, two-layer network, stochastic residual update.

    `fc1` and `fc2` have the layout of the authors' public weights: `fc1` reads the blocks Laplacian, y, z, x
    (of `channels` each), the state, then the condition.

    Args:
        channels: C, of a cell's state.
        hidden: width of the hidden layer.
        condition: d, of the condition vector h of a cell; 0 for none.
        degree: highest degree of the spherical harmonics: 0, 1 (the paper) or 2.
    """

    def __init__(self, channels: int = 16, hidden: int = 128, condition: int = 0, degree: int = 1) -> None:
        super().__init__()
        if degree not in HARMONICS:
            raise ConfigError(f"spherical harmonics of degree {degree}", "use 0, 1 or 2")
        self.channels, self.hidden, self.condition, self.degree = channels, hidden, condition, degree
        self.fc1 = dense.ZeroLinear((HARMONICS[degree] + 1) * channels + condition, hidden)
        self.fc2 = dense.ZeroLinear(hidden, channels)

    def initialise(self, generator: torch.Generator, gain: float = 1.2) -> None:
        """The authors' initial weights: Xavier normal, gains 0.2 and `gain`, no bias in the last layer."""
        nn.init.xavier_normal_(self.fc1.weight, gain=0.2, generator=generator)
        nn.init.xavier_normal_(self.fc2.weight, gain=gain, generator=generator)
        bound = self.fc1.in_features**-0.5
        nn.init.uniform_(self.fc1.bias, -bound, bound, generator=generator)
        nn.init.zeros_(self.fc2.bias)

    def seed(self, mesh: Mesh | Perception, batch: int = 1) -> torch.Tensor:
        """The initial state: zeros (B, V, C)."""
        vertices = mesh.vertices if isinstance(mesh, Perception) else len(mesh.vertices)
        return self.fc1.weight.new_zeros(batch, vertices, self.channels)

    def step(
        self,
        state: torch.Tensor,
        mesh: Mesh | Perception,
        mask: torch.Tensor | None = None,
        condition: torch.Tensor | None = None,
    ) -> torch.Tensor:
        """One step of the automaton (equations 1 to 3).

        Args:
            state: (B, V, C) float32.
            mesh: a mesh, or its perception operator (which may carry an orientation).
            mask: which cells update, boolean (V,) or (B, V); None updates all.
            condition: h, (V, d) or (B, V, d); required when the model has one.

        Returns:
            The next state (B, V, C), differentiable in state, parameters and condition.

        Raises:
            ConfigError: shapes that do not fit.
        """
        operator = mesh
        if not isinstance(operator, Perception):
            operator = perception(operator, self.degree, device=state.device)
        self._check(state, operator, mask, condition)
        rows = None
        if mask is not None:
            rows = mask.expand(state.shape[:2]).reshape(-1).nonzero().squeeze(1)
        if condition is not None:
            condition = condition.expand(*state.shape[:2], self.condition)
        weights = (self.fc1.weight, self.fc1.bias, self.fc2.weight, self.fc2.bias)
        return _Step.apply(state, condition, *weights, operator, rows)

    def evolve(
        self,
        state: torch.Tensor,
        mesh: Mesh | Perception,
        steps: int,
        generator: torch.Generator,
        condition: torch.Tensor | None = None,
        advection: Callable[[torch.Tensor], torch.Tensor] | None = None,
    ) -> torch.Tensor:
        """`steps` steps, each with a fresh random mask drawn on the CPU, so that devices agree, and
        followed by an `advection` of the states (B, V, C) if there is one.
        """
        for _ in range(steps):
            mask = torch.rand(state.shape[:2], generator=generator) < FIRE_RATE
            state = self.step(state, mesh, mask.to(state.device), condition)
            state = state if advection is None else advection(state)
        return state

    def _check(
        self,
        state: torch.Tensor,
        operator: Perception,
        mask: torch.Tensor | None,
        condition: torch.Tensor | None,
    ) -> None:
        if state.ndim != 3 or state.shape[1:] != (operator.vertices, self.channels):
            expected = f"(B, {operator.vertices}, {self.channels})"
            raise ConfigError(f"a state of shape {tuple(state.shape)}", f"give {expected}")
        if operator.blocks != HARMONICS[self.degree] + 1:
            raise ConfigError(
                "the perception's degree is not the model's", f"build it with degree={self.degree}"
            )
        shapes = ((operator.vertices,), tuple(state.shape[:2]))
        if mask is not None and (mask.dtype != torch.bool or mask.shape not in shapes):
            raise ConfigError(
                f"a mask of {mask.dtype}, shape {tuple(mask.shape)}", "give booleans (V,) or (B, V)"
            )
        width = 0 if condition is None else condition.shape[-1]
        if width != self.condition:
            raise ConfigError(f"a condition of width {width}", f"this model takes {self.condition}")
        if condition is not None and condition.shape[:-1] not in shapes:
            raise ConfigError(f"a condition of shape {tuple(condition.shape)}", "give (V, d) or (B, V, d)")


class _Step(torch.autograd.Function):
    """state + fc2(relu(fc1([perception(state), condition]))) in `rows`, with a backward pass of its own.

    Only the cells that update go through the network, half of them with the usual mask.
    """

    @staticmethod
    def forward(
        ctx: Any,
        state: torch.Tensor,
        condition: torch.Tensor | None,
        w1: torch.Tensor,
        b1: torch.Tensor,
        w2: torch.Tensor,
        b2: torch.Tensor,
        operator: Perception,
        rows: torch.Tensor | None,
    ) -> torch.Tensor:
        batch, vertices, channels = state.shape
        inputs = operator(state).view(batch * vertices, -1)
        if condition is not None:
            inputs = torch.cat([inputs, condition.reshape(batch * vertices, -1)], 1)
        if rows is not None:
            inputs = inputs.index_select(0, F.pad(rows, (0, dense.padded(len(rows)) - len(rows))))
        hidden = dense.product(inputs, w1, b1).relu_()
        change = dense.product(hidden, w2, b2)
        ctx.save_for_backward(inputs, hidden, w1, w2, rows)
        ctx.perception, ctx.shape = operator, state.shape
        if rows is None:
            return state + change.view_as(state)
        out = state.reshape(-1, channels).clone().index_add_(0, rows, change[: len(rows)])
        return out.view(batch, vertices, channels)

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, gradient: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        """Gradients have the names of `forward`'s tensors, after `d_`."""
        inputs, hidden, w1, w2, rows = ctx.saved_tensors
        batch, vertices, channels = ctx.shape
        d_change = gradient.reshape(-1, channels)
        if rows is not None:
            d_change = F.pad(d_change.index_select(0, rows), (0, 0, 0, len(inputs) - len(rows)))
        d_hidden = dense.product(d_change, w2.t())
        torch.ops.aten.threshold_backward.grad_input(d_hidden, hidden, 0, grad_input=d_hidden)
        d_state = d_condition = None
        if any(ctx.needs_input_grad[:2]):  # not in the first step from the pool
            d_inputs = dense.product(d_hidden, w1.t())
            if rows is not None:
                whole = d_inputs.new_zeros(batch * vertices, d_inputs.shape[1])
                d_inputs = whole.index_copy_(0, rows, d_inputs[: len(rows)])
            width = ctx.perception.blocks * channels
            d_perceived = d_inputs[:, :width].contiguous().view(batch, vertices, width)
            d_state = gradient + ctx.perception.transposed(d_perceived)
            if d_inputs.shape[1] > width:
                d_condition = d_inputs[:, width:].view(batch, vertices, -1)
        return (
            d_state,
            d_condition,
            dense.weight_gradient(d_hidden, inputs),
            d_hidden.sum(0),
            dense.weight_gradient(d_change, hidden),
            d_change.sum(0),
            None,
            None,
        )
