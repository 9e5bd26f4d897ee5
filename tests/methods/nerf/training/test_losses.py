"""Losses against sums written out, finite differences, and what they are for."""

import math

import numpy as np
import pytest
import torch
from torch.autograd import gradcheck

from mitex.methods.nerf.training import losses
from mitex.methods.nerf.training.losses import clustering, distortion, normal_agreement

FREE = math.cos(math.pi / 8)


def _normal(*shape, seed=0):
    return torch.randn(*shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def _equation_3(features, centres, kappa):
    """Q and P as printed, element by element."""
    n, k = len(features), len(centres)
    q, p = np.zeros((n, k)), np.zeros((n, k))
    for i in range(n):
        kernel = [(1 + sum((features[i] - centres[j]) ** 2) / kappa) ** (-(kappa + 1) / 2) for j in range(k)]
        for j in range(k):
            q[i, j] = kernel[j] / sum(kernel)
    for i in range(n):
        hard = [q[i, j] ** 2 / q[:, j].sum() for j in range(k)]
        for j in range(k):
            p[i, j] = hard[j] / sum(hard)
    return q, p


@pytest.mark.parametrize("kappa", [1.0, 2.5])
def test_clustering_is_equation_3(kappa):
    features, centres = _normal(7, 3), _normal(4, 3, seed=1)
    q, p = _equation_3(features.numpy(), centres.numpy(), kappa)
    expected = (p * np.log(p / q)).sum() / q.size
    assert clustering(features, centres, kappa).item() == pytest.approx(expected, rel=1e-12)


@pytest.mark.parametrize("kappa", [1.0, 2.5])
def test_clustering_has_the_gradient_of_a_constant_p(kappa):
    """Autograd of the printed sums, P without a derivative; with one it would be another."""
    features, centres = _normal(7, 2).requires_grad_(), _normal(4, 2, seed=1).requires_grad_()
    square = (features[:, None] - centres).square().sum(2)
    q = (1 + square / kappa) ** (-(kappa + 1) / 2)
    q = q / q.sum(1, keepdim=True)
    p = q.square() / q.sum(0)
    p = p / p.sum(1, keepdim=True)
    gradients = torch.autograd.grad(clustering(features, centres, kappa), (features, centres))
    for attached in (False, True):
        hard = p if attached else p.detach()
        loss = (hard * (hard / q).log()).mean()
        expected = torch.autograd.grad(loss, (features, centres), retain_graph=True)
        same = [torch.allclose(a, b, rtol=1e-10, atol=0) for a, b in zip(gradients, expected, strict=True)]
        assert same == [not attached] * 2


def test_clustering_is_the_same_in_parts(monkeypatch):
    features, centres = _normal(23, 2).requires_grad_(), _normal(4, 2, seed=1).requires_grad_()
    whole = clustering(features, centres)
    monkeypatch.setattr(losses, "PART", 5)
    parts = clustering(features, centres)
    torch.testing.assert_close(parts, whole, rtol=1e-12, atol=0)
    for a, b in zip(*(torch.autograd.grad(x, (features, centres)) for x in (whole, parts)), strict=True):
        torch.testing.assert_close(a, b, rtol=1e-10, atol=0)


def test_clustering_scales_with_the_gradient_that_comes_in():
    features, centres = _normal(5, 2).requires_grad_(), _normal(3, 2, seed=1)
    (once,) = torch.autograd.grad(clustering(features, centres), features)
    (thrice,) = torch.autograd.grad(3 * clustering(features, centres), features)
    torch.testing.assert_close(thrice, 3 * once)


def test_clustering_is_never_negative_and_zero_where_all_centres_are_equal():
    for seed in range(20):
        assert clustering(_normal(9, 2, seed=seed), 3 * _normal(4, 2, seed=seed + 99)) > 0
    same = _normal(1, 2).expand(4, 2)
    assert clustering(_normal(9, 2), same).item() == pytest.approx(0, abs=1e-15)


def test_clustering_draws_features_to_their_centres():
    centres = torch.tensor([[-1.0, 0.0], [1.0, 0.0]])
    features = torch.tensor([[-0.6, 0.5], [-0.4, -0.2], [0.3, 0.1], [0.7, -0.5]]).requires_grad_()
    clustering(features, centres).backward()
    assert features.grad is not None
    for feature, downhill in zip(features.detach(), -features.grad, strict=True):
        own, other = (centres[0], centres[1]) if feature[0] < 0 else (centres[1], centres[0])
        assert downhill @ (own - feature) > 0 > downhill @ (other - feature)


def test_clustering_sees_features_that_have_hardly_left_their_start():
    """In float32, P and Q would be equal at the initial 1e-4, and centres would feel only rounding."""
    features = (1e-4 * _normal(500, 2)).float().requires_grad_()
    centres = (1e-4 * _normal(4, 2, seed=1)).float().requires_grad_()
    gradients = torch.autograd.grad(clustering(features, centres), (features, centres))
    exact = (features.detach().double().requires_grad_(), centres.detach().double().requires_grad_())
    expected = torch.autograd.grad(clustering(*exact), exact)
    for a, b in zip(gradients, expected, strict=True):
        assert b.abs().max() > 0
        torch.testing.assert_close(a.double(), b, rtol=1e-5, atol=0)


def _samples(lengths, seed=0):
    """Weights, midpoints, widths and rays of rays with so many samples each."""
    generator = torch.Generator().manual_seed(seed)
    rays = torch.arange(len(lengths)).repeat_interleave(torch.tensor(lengths))
    count = len(rays)
    edges = [torch.rand(n + 1, generator=generator, dtype=torch.float64).sort().values for n in lengths]
    weights = torch.rand(count, generator=generator, dtype=torch.float64)
    midpoints = torch.cat([(e[1:] + e[:-1]) / 2 for e in edges])
    return weights, midpoints, torch.cat([e.diff() for e in edges]), rays


def _all_pairs(weights, midpoints, widths, rays):
    total = torch.zeros((), dtype=weights.dtype)
    for i in range(len(rays)):
        total = total + weights[i] ** 2 * widths[i] / 3
        for j in range(len(rays)):
            if rays[i] == rays[j]:
                total = total + weights[i] * weights[j] * (midpoints[i] - midpoints[j]).abs()
    return total / len(rays.unique())


@pytest.mark.parametrize("lengths", [[1], [9], [3, 1, 7, 2], [4, 0, 5]])
def test_distortion_is_the_sum_over_all_pairs_of_each_ray(lengths):
    samples = _samples(lengths)
    torch.testing.assert_close(distortion(*samples), _all_pairs(*samples), rtol=1e-12, atol=0)


def test_distortion_is_the_integral_that_it_stands_for():
    """Mip-NeRF 360, equation 14: double integral of w(u) w(v) |u - v| for weights spread over intervals."""
    weights, midpoints, widths, rays = _samples([6], seed=3)
    count = 1500
    u = torch.linspace(0, 1, count + 1, dtype=torch.float64)
    u = (u[1:] + u[:-1]) / 2
    inside = (u[:, None] - midpoints).abs() < widths / 2
    density = (inside * (weights / widths)).sum(1) / count
    expected = density @ (u[:, None] - u).abs() @ density
    assert distortion(weights, midpoints, widths, rays).item() == pytest.approx(expected.item(), rel=1e-2)


def test_distortion_has_the_derivatives_of_finite_differences():
    weights, midpoints, widths, rays = _samples([3, 1, 4])
    floats = [x.requires_grad_() for x in (weights, midpoints, widths)]
    assert gradcheck(lambda w, m, d: distortion(w, m, d, rays), floats)


def test_distortion_stays_precise_among_many_rays():
    weights, midpoints, widths, rays = (x.repeat(20_000) for x in _samples([5]))
    rays = torch.arange(20_000).repeat_interleave(5)
    expected = distortion(*_samples([5])).item()
    # Weights of empty space, behind all those sums.
    weights[-5:] *= 1e-4
    many, few = weights.float().requires_grad_(), weights[-5:].float().requires_grad_()
    midpoints, widths = midpoints.float(), widths.float()
    loss = distortion(many, midpoints, widths, rays)
    assert loss.dtype == torch.float32
    assert loss.item() == pytest.approx(expected * 19_999 / 20_000, rel=1e-6)
    loss.backward()
    distortion(few, midpoints[-5:], widths[-5:], rays[-5:]).backward()
    assert many.grad is not None and few.grad is not None
    torch.testing.assert_close(many.grad[-5:] * 20_000, few.grad, rtol=1e-5, atol=0)


def test_distortion_of_no_samples_is_zero_with_a_gradient():
    empty = torch.zeros(0, requires_grad=True)
    loss = distortion(empty, torch.zeros(0), torch.zeros(0), torch.zeros(0, dtype=torch.int64))
    loss.backward()
    assert loss.item() == 0 and empty.grad is not None and empty.grad.shape == (0,)


def _at_angles(*angles):
    """Unit vectors at these angles from z."""
    return torch.tensor([[math.sin(a), 0.0, math.cos(a)] for a in angles], dtype=torch.float64)


def test_normals_within_the_free_angle_cost_the_least_and_have_no_gradient():
    z = _at_angles(0, 0, 0)
    predicted = _at_angles(0.0, 0.2, math.pi / 8 - 1e-3).requires_grad_()
    loss = normal_agreement(predicted, z)
    loss.backward()
    assert loss.item() == pytest.approx(-FREE) and predicted.grad is not None and not predicted.grad.any()


def test_normals_beyond_the_free_angle_turn_to_the_target():
    angles = [math.pi / 8 + 1e-3, 1.0, 2.0, 3.0]
    predicted = _at_angles(*angles).requires_grad_()
    loss = normal_agreement(predicted, _at_angles(*[0.0] * 4))
    loss.backward()
    assert predicted.grad is not None
    assert loss.item() == pytest.approx(-np.cos(angles).mean())
    # By - sin(angle) / 4 along the circle, whatever the sign that equation 5 is printed with.
    towards = -_at_angles(*[a + math.pi / 2 for a in angles])
    torch.testing.assert_close(
        (-predicted.grad * towards).sum(1), torch.tensor(angles, dtype=torch.float64).sin() / 4
    )


def test_normals_count_by_direction_and_the_target_is_constant():
    predicted, target = _normal(8, 3).requires_grad_(), _normal(8, 3, seed=1).requires_grad_()
    loss = normal_agreement(predicted, target)
    assert normal_agreement(predicted * 0.01, target * 7).item() == pytest.approx(loss.item())
    loss.backward()
    assert target.grad is None
    assert gradcheck(lambda x: normal_agreement(x, target.detach()), [predicted])


def test_rays_without_a_normal_have_a_finite_gradient():
    predicted = torch.zeros(2, 3, requires_grad=True)
    normal_agreement(predicted, _at_angles(0, 0).float()).backward()
    assert predicted.grad is not None and predicted.grad.isfinite().all()
