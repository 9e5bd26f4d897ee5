"""Lucas and Kanade's method on frames whose motion is known."""

import pytest
import torch

from mitex.errors import ImageError
from mitex.features.flow import lucas_kanade, smaller_eigenvalue
from tests.features.flow.synthetic import affine, errors, pair, shift


def estimate(frames: torch.Tensor) -> torch.Tensor:
    return lucas_kanade(frames[:, :1], frames[:, 1:])


@pytest.mark.parametrize("motion", [(0.3, 0.0), (0.0, -0.7), (1.6, 1.1), (-3.0, 2.5)])
def test_translations_to_a_fraction_of_a_pixel(motion):
    measured = errors(estimate(pair(shift(*motion))), shift(*motion))
    assert measured.mean() < 0.015 and measured.max() < 0.08


@pytest.mark.parametrize(
    "matrix",
    [[[0.04, 0.0], [0.0, 0.04]], [[0.0, -0.05], [0.05, 0.0]], [[0.0, 0.06], [0.0, 0.0]]],
    ids=["zoom", "rotation", "shear"],
)
def test_affine_motions(matrix):
    measured = errors(estimate(pair(affine(matrix))), affine(matrix))
    assert measured.mean() < 0.04 and measured.max() < 0.15


def test_equal_frames_do_not_move():
    assert estimate(pair(shift(0.0, 0.0))).abs().max() < 1e-5


def test_nothing_moves_on_plain_frames():
    assert estimate(torch.full((1, 2, 40, 40), 0.3).double()).abs().max() < 1e-6


def test_brightness_and_contrast_do_not_matter():
    motion, frames = shift(0.9, -0.4), pair(shift(0.9, -0.4))
    frames[:, 1] = 0.6 * frames[:, 1] + 0.3
    assert errors(estimate(frames), motion).mean() < 0.015


def test_the_motion_across_stripes_is_all_that_shows():
    stripes = pair(shift(0.0, 0.0))[:, :1, 32:33].expand(1, 1, 64, 64)
    assert smaller_eigenvalue(stripes)[0, 8:-8, 8:-8].max() < 1e-5
    assert smaller_eigenvalue(pair(shift(0.0, 0.0))[:, :1])[0, 8:-8, 8:-8].min() > 1e-3


def test_frames_need_not_be_square():
    motion = torch.tensor([1.2, -0.6]).double()[:, None, None].expand(2, 45, 70)
    assert errors(estimate(pair(motion)), motion).mean() < 0.03


def test_gradient_by_finite_differences():
    frames = pair(shift(0.8, 0.5, side=32)).double().requires_grad_()
    weights = torch.randn(1, 2, 32, 32, generator=torch.Generator().manual_seed(0)).double()
    (gradient,) = torch.autograd.grad((estimate(frames) * weights).sum(), frames)
    direction = torch.randn(frames.shape, generator=torch.Generator().manual_seed(1)).double()
    ahead, behind = (estimate(frames.detach() + s * 1e-6 * direction) for s in (1, -1))
    expected = ((ahead - behind) * weights).sum() / 2e-6
    assert float((gradient * direction).sum()) == pytest.approx(float(expected), rel=1e-3)


@pytest.mark.parametrize(
    ("first", "second", "message"),
    [
        ((1, 2, 40, 40), (1, 2, 40, 40), "shapes"),
        ((1, 1, 40, 40), (1, 1, 40, 41), "shapes"),
        ((1, 1, 31, 40), (1, 1, 31, 40), "too small"),
    ],
)
def test_frames_that_do_not_fit(first, second, message):
    with pytest.raises(ImageError, match=message):
        lucas_kanade(torch.zeros(first), torch.zeros(second))
