"""Adam, schedule and gradient normalisation."""

import math

import pytest
import torch

from mitex.training import optim
from mitex.training.optim import Adam, gradient_norms, multistep, normalise_gradients


def _pair():
    generator = torch.Generator().manual_seed(1)
    ours = [torch.nn.Parameter(torch.randn(shape, generator=generator)) for shape in ((4, 3), (5,), ())]
    return ours, [torch.nn.Parameter(p.detach().clone()) for p in ours], generator


def test_adam_is_bit_equal_to_torchs():
    ours, theirs, generator = _pair()
    adam = Adam(ours)
    reference = torch.optim.Adam(theirs, lr=0.0, foreach=False)
    schedule = multistep(0.1, [3, 6], 0.3)
    for step in range(10):
        for i, (p, q) in enumerate(zip(ours, theirs, strict=True)):
            p.grad = None if (i, step) in ((0, 0), (2, 5)) else torch.randn(p.shape, generator=generator)
            q.grad = None if p.grad is None else p.grad.clone()
        reference.param_groups[0]["lr"] = schedule(step)
        adam.step(schedule(step))
        reference.step()
        assert all(torch.equal(p, q) for p, q in zip(ours, theirs, strict=True)), step


@pytest.mark.parametrize("shared", [False, True])
@pytest.mark.parametrize("shape", [(100, 3), (3, 100), (300,)])
def test_adam_in_parts_is_adam(monkeypatch, shape, shared):
    one, two = (torch.nn.Parameter(torch.ones(shape)) for _ in range(2))
    whole, parts = Adam([one], shared=shared), Adam([two], shared=shared)
    generator = torch.Generator().manual_seed(2)
    for _ in range(3):
        one.grad = two.grad = torch.randn(shape[::-1], generator=generator).permute(*range(len(shape))[::-1])
        whole.step(0.1)
        with monkeypatch.context() as patch:
            patch.setattr(optim, "PART", 64)
            parts.step(0.1)
    assert torch.equal(one, two)


def test_adam_first_step_moves_by_the_learning_rate():
    p = torch.nn.Parameter(torch.tensor([1.0, 1.0]))
    p.grad = torch.tensor([5.0, -0.01])
    Adam([p]).step(0.1)
    torch.testing.assert_close(p.detach(), torch.tensor([0.9, 1.1]))


def test_adam_state_round_trip():
    ours, theirs, generator = _pair()
    one, two = Adam(ours), Adam(theirs)
    for _ in range(3):
        for p in ours:
            p.grad = torch.randn(p.shape, generator=generator)
        one.step(0.1)
    two.load_state({name: tensor.clone() for name, tensor in one.state().items()})
    for p, q in zip(ours, theirs, strict=True):
        q.data.copy_(p.data)
        p.grad = q.grad = torch.ones_like(p)
    one.step(0.1)
    two.step(0.1)
    assert all(torch.equal(p, q) for p, q in zip(ours, theirs, strict=True))


@pytest.mark.parametrize("shapes", [((4, 3), (5,)), ((4, 3), (5,), (1,)), ((3, 4), (5,), ())])
def test_adam_refuses_the_state_of_other_parameters(shapes):
    ours, _, _ = _pair()
    adam = Adam(ours)
    other = Adam([torch.nn.Parameter(torch.ones(shape)) for shape in shapes])
    for moment in other.first:
        moment.fill_(7)
    with pytest.raises(ValueError):
        adam.load_state(other.state())
    assert all(not m.any() for m in adam.first)


def test_multistep_multiplies_from_the_milestone_on():
    schedule = multistep(1.0, [4, 2], 0.5)
    assert [schedule(step) for step in range(6)] == [1.0, 1.0, 0.5, 0.5, 0.25, 0.25]
    assert multistep(0.3)(1000) == 0.3


def test_normalise_gradients_by_tensor():
    p, q, r = (torch.nn.Parameter(torch.zeros(2)) for _ in range(3))
    p.grad, q.grad = torch.tensor([3.0, 4.0]), torch.zeros(2)
    assert gradient_norms([p, q, r]).tolist() == [5.0, 0.0, 0.0]
    normalise_gradients([p, q, r])
    torch.testing.assert_close(p.grad, torch.tensor([0.6, 0.8]))
    assert q.grad.tolist() == [0.0, 0.0]
    assert r.grad is None
    p.grad = torch.tensor([1e-8, 0.0])  # the 1e-8 in the denominator halves it
    normalise_gradients([p])
    assert math.isclose(p.grad[0].item(), 0.5, rel_tol=1e-6)


def test_a_shared_second_moment_keeps_the_gradients_proportions():
    """The first step is lr g / rms(g): elements with a small gradient move little."""
    gradient = torch.tensor([3.0, -4.0, 0.0, 1e-4])
    x = torch.zeros(4, requires_grad=True)
    adam = Adam([x], shared=True)
    x.grad = gradient.clone()
    adam.step(0.1)
    assert torch.allclose(x.detach(), -0.1 * gradient / gradient.square().mean().sqrt(), rtol=1e-5)
    again = Adam([torch.zeros(4)], shared=True)
    again.load_state(adam.state())
    assert torch.equal(again.second[0], adam.second[0]) and again.second[0].ndim == 0
