"""The overflow loss."""

import pytest
import torch

from mitex.losses import overflow_loss


def test_by_hand():
    """Distances 0, 0.5, 2, 0: also of states of any shape."""
    state = torch.tensor([0.3, 1.5, -3.0, -1.0])
    assert overflow_loss(state).item() == pytest.approx(2.5 / 4)
    assert overflow_loss(state.view(1, 2, 2)).item() == pytest.approx(2.5 / 4)
    assert overflow_loss(state, bound=2.0).item() == pytest.approx(1 / 4)


def test_gradient_pushes_back_what_is_outside():
    state = torch.tensor([0.3, 1.5, -3.0, 0.99], requires_grad=True)
    overflow_loss(state).backward()
    assert state.grad is not None
    assert state.grad.tolist() == [0, 0.25, -0.25, 0]
