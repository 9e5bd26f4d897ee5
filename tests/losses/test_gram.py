"""Gram matrices and their loss."""

import pytest
import torch

from mitex.losses import gram_loss, gram_matrix


@pytest.fixture
def features():
    return torch.rand(2, 7, 4, generator=torch.Generator().manual_seed(5), dtype=torch.float64)


def test_matrix_is_the_mean_of_outer_products(features):
    matrix = gram_matrix(features)
    for k in range(2):
        expected = sum(torch.outer(v, v) for v in features[k]) / 7
        assert torch.allclose(matrix[k], torch.as_tensor(expected))


def test_matrix_by_hand():
    assert gram_matrix(torch.tensor([[1.0, 2.0], [3.0, 0.0]])).tolist() == [[5.0, 1.0], [1.0, 2.0]]


def test_loss_averages_entries_and_images_and_adds_layers(features):
    target = {"a": torch.zeros(4, 4, dtype=torch.float64), "b": gram_matrix(features[0])}
    layers = {"a": features, "b": features, "unused": features}
    a = gram_matrix(features).square().sum() / 32
    b = (gram_matrix(features[1]) - target["b"]).square().sum() / 32
    assert gram_loss(layers, target).item() == pytest.approx((a + b).item())
    weighted = gram_loss(layers, target, {"a": 3.0})
    assert weighted.item() == pytest.approx((3 * a + b).item())


def test_loss_of_the_exemplar_itself_is_zero(features):
    shuffled = features[:1, torch.randperm(7)]
    assert gram_loss({"a": shuffled}, {"a": gram_matrix(features[0])}).item() == pytest.approx(0)


def test_gradient_is_a_finite_difference(features):
    target = {"a": gram_matrix(features[0].flip(1))}
    x = features.clone().requires_grad_()
    assert torch.autograd.gradcheck(lambda f: gram_loss({"a": f}, target), (x,))
