"""The motion loss against a loop over pixels, finite differences, and motions whose loss is known."""

import math

import pytest
import torch

from mitex.losses import motion_loss

STEPS, PERIOD, GAMMA = 6, 24.0, 1.5
OPTIONS = {"steps": STEPS, "period": PERIOD, "gamma": GAMMA}


def _random(*shape, seed=0, dtype=torch.float64):
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed), dtype=dtype)


def _slow(flow, target, mask):
    """Equations 11 to 13, pixel by pixel."""
    rows = [(b, y, x) for b in range(len(flow)) for y in range(flow.shape[2]) for x in range(flow.shape[3])]
    rows = [(b, y, x) for b, y, x in rows if mask[b, y, x]]
    lengths = {row: math.hypot(*target[row[0], :, row[1], row[2]].tolist()) for row in rows}
    mean = sum(lengths.values()) / len(rows)
    direction, strength, count = 0.0, 0.0, 0
    for (b, y, x), length in lengths.items():
        if length <= 0.05 * mean:
            continue
        (u, v), (p, q) = flow[b, :, y, x].tolist(), target[b, :, y, x].tolist()
        direction += 1 - (u * p + v * q) / math.hypot(u, v) / length
        strength += abs(PERIOD / STEPS * math.hypot(u, v) - length)
        count += 1
    direction, strength = direction / count, strength / count
    total = direction if direction >= 1 else (1 - direction) * strength + GAMMA * direction
    return direction, strength, total


@pytest.mark.parametrize("sign", [1, -1])
def test_it_is_the_loop_over_the_pixels_that_count(sign):
    """For motions that are nearly right, and nearly opposite: both cases of equation 13."""
    target = _random(2, 2, 4, 5)
    target[0, :, 1, 2] *= 0.01  # no direction to speak of
    flow = sign * STEPS / PERIOD * target + 0.1 * _random(2, 2, 4, 5, seed=1)
    flow[0, :, 1, 2] = 100
    mask = _random(2, 4, 5, seed=2) > -0.5
    mask[0, 1, 2], flow[1, :, 3, 4] = True, 50
    mask[1, 3, 4] = False
    loss, expected = motion_loss(flow, target, mask, **OPTIONS), _slow(flow, target, mask)
    assert [value.item() for value in loss] == pytest.approx(expected, rel=1e-9)
    assert (expected[0] < 1) == (sign == 1)


@pytest.mark.parametrize("sign", [1, -1])
def test_the_gradient_is_that_of_finite_differences(sign):
    """Of both parts, and of their combination with a factor that stays as it is."""
    target, mask = _random(1, 2, 3, 3), torch.ones(1, 3, 3, dtype=torch.bool)
    flow = (sign * 0.3 * target + 0.2 * _random(1, 2, 3, 3, seed=1)).requires_grad_()
    parts = [lambda f, at=at: motion_loss(f, target, mask, **OPTIONS)[at] for at in (0, 1)]
    assert all(torch.autograd.gradcheck(part, flow) for part in parts)
    direction, strength, total = motion_loss(flow, target, mask, **OPTIONS)
    factor = 1 - direction.item()
    expected = direction if factor <= 0 else factor * strength + GAMMA * direction
    gradients = [torch.autograd.grad(value, flow, retain_graph=True)[0] for value in (total, expected)]
    assert (factor > 0) == (sign == 1) and torch.allclose(*gradients, rtol=1e-12)


@pytest.mark.parametrize("share", [0.05, 0.5, 1.0, 2.0])
@pytest.mark.parametrize("length", [0.5, 4.0, 20.0])
@pytest.mark.parametrize("degrees", [5, 45, 85, 130])
def test_a_descent_turns_towards_the_target(share, length, degrees):
    """At any speed, also where the strength is off by much more than gamma."""
    angle = torch.tensor(math.radians(degrees), dtype=torch.float64, requires_grad=True)
    turned = torch.stack([angle.cos(), angle.sin()])[None, :, None, None].expand(1, 2, 4, 4)
    target = torch.zeros(1, 2, 4, 4, dtype=torch.float64)
    target[:, 0] = length
    flow = share * length * STEPS / PERIOD * turned
    motion_loss(flow, target, **OPTIONS).total.backward()
    assert angle.grad is not None and angle.grad > 0


def test_the_right_motion_costs_nothing():
    """It is the target's for as many steps; at another speed only the strength is wrong."""
    target = _random(2, 2, 8, 8)
    right = motion_loss(STEPS / PERIOD * target, target, **OPTIONS)
    assert max(value.abs().item() for value in right) < 1e-9
    fast = motion_loss(2 * STEPS / PERIOD * target, target, **OPTIONS)
    assert fast.direction.item() == pytest.approx(0, abs=1e-9)
    assert fast.strength.item() == pytest.approx(target.norm(dim=1).mean().item())
    assert motion_loss(-target, target, **OPTIONS).direction.item() == pytest.approx(2)


@pytest.mark.parametrize("nothing", ["target", "mask", "flow"])
def test_where_nothing_moves_the_loss_is_finite(nothing):
    """Also its gradient, in single precision."""
    flow = torch.full((1, 2, 4, 4), 0.5)
    target, mask = torch.ones(1, 2, 4, 4), torch.ones(1, 4, 4, dtype=torch.bool)
    if nothing == "target":
        target.zero_()
    elif nothing == "mask":
        mask.zero_()
    else:
        flow.zero_()
    flow.requires_grad_()
    loss = motion_loss(flow, target, mask, **OPTIONS)
    loss.total.backward()
    assert flow.grad is not None and flow.grad.isfinite().all()
    assert loss.total.item() == (1 if nothing == "flow" else 0)
