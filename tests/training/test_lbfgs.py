"""L-BFGS against closed forms, and its state."""

import pytest
import torch

from mitex.training.lbfgs import Lbfgs
from mitex.training.optim import Adam


def quadratic(x, scales):
    return 0.5 * (scales * x.square()).sum()


def advance(optimizer, loss, lr):
    optimizer.clear()
    loss().backward()
    optimizer.step(lr)


def test_a_quadratic_is_minimised_in_few_steps():
    """Conditioned 1:1000; gradient descent with the best fixed rate would still be at 0.9 after 50 steps.

    In double precision: in single precision rounding moves the last steps, differently on each processor.
    """
    scales = torch.logspace(0, 3, 8, dtype=torch.float64)
    x, y = (torch.ones(n, dtype=torch.float64, requires_grad=True) for n in (3, 5))
    optimizer = Lbfgs([x, y])
    for _ in range(50):
        advance(optimizer, lambda: quadratic(torch.cat([x, y]), scales), 1.0)
    assert quadratic(torch.cat([x, y]), scales) < 1e-9


def test_one_pair_gives_the_curvature_of_a_line():
    x = torch.tensor([5.0], requires_grad=True)
    optimizer = Lbfgs([x])
    advance(optimizer, lambda: quadratic(x, 7.0), 1.0)
    assert x.item() == pytest.approx(4.0)  # the first step is as long as it may be
    advance(optimizer, lambda: quadratic(x, 7.0), 10.0)
    assert x.item() == pytest.approx(0.0, abs=1e-5)


def test_no_element_moves_further_than_the_bound():
    x = torch.tensor([5.0, -3.0], requires_grad=True)
    optimizer = Lbfgs([x])
    for _ in range(6):
        before = x.detach().clone()
        advance(optimizer, lambda: quadratic(x, torch.tensor([1.0, 40.0])), 0.25)
        assert (x - before).abs().max() <= 0.25 * (1 + 1e-5)


def test_negative_curvature_is_not_kept():
    x = torch.tensor([0.5], requires_grad=True)
    optimizer = Lbfgs([x])
    for _ in range(3):
        advance(optimizer, lambda: -x.square().sum(), 0.1)
    assert optimizer.counts == [3, 0] and x.item() == pytest.approx(0.8)


def test_state_round_trip():
    scales = torch.tensor([1.0, 10.0, 100.0])
    one, two = torch.ones(3, requires_grad=True), torch.ones(3, requires_grad=True)
    first, second = Lbfgs([one], memory=3), Lbfgs([two], memory=3)
    for _ in range(5):
        advance(first, lambda: quadratic(one, scales), 0.3)
    second.load_state({name: tensor.clone() for name, tensor in first.state().items()})
    two.data.copy_(one.data)
    for _ in range(2):
        advance(first, lambda: quadratic(one, scales), 0.3)
        advance(second, lambda: quadratic(two, scales), 0.3)
    assert torch.equal(one, two)


@pytest.mark.parametrize("other", [Adam([torch.ones(3)]), Lbfgs([torch.ones(4)])])
def test_another_state_is_refused(other):
    with pytest.raises(ValueError):
        Lbfgs([torch.ones(3)]).load_state(other.state())
