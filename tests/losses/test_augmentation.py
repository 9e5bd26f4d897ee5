import pytest
import torch

from mitex.losses import Augmentation
from mitex.losses.augmentation import CORNERS


def _draw(seed=0, **options):
    return Augmentation.draw(torch.Generator().manual_seed(seed), **options)


def _ramp(side, count=1):
    """Pictures (count, side, side, 2) whose values are the place, (x, y) from -1 to 1."""
    steps = (torch.arange(side) + 0.5) * (2 / side) - 1
    y, x = torch.meshgrid(steps, steps, indexing="ij")
    return torch.stack([x, y], 2).expand(count, -1, -1, -1)


def test_nothing_is_done_without_tilt_to_a_whole_picture():
    pictures = torch.rand(3, 16, 16, 3)
    assert torch.allclose(_draw(pictures=3, tilt=0.0)(pictures, 16), pictures, atol=1e-5)


def test_squares_are_of_their_area_and_lie_within_the_picture():
    draw = _draw(pictures=2, squares=50, area=0.09, tilt=0.0)
    assert draw.picture.tolist() == [0] * 50 + [1] * 50
    squares = draw(_ramp(128, 2), 33)
    assert squares.shape == (100, 33, 33, 2)
    spread = squares.amax((1, 2)) - squares.amin((1, 2))
    assert torch.allclose(spread, torch.tensor(0.6 * 32 / 33), atol=3e-3)
    middle = squares[:, 16, 16]
    assert middle.abs().amax() < 0.7 and middle.std(0).min() > 0.3


def test_corners_are_moved_outwards_as_far_as_the_tilt():
    draw = _draw(pictures=200, tilt=0.5)
    corners = torch.tensor([[*corner, 1.0] for corner in CORNERS])
    moved = corners @ draw.homography.transpose(1, 2)
    factor = moved[..., :2] / moved[..., 2:] / corners[:, :2]
    assert factor.min() >= 1 - 1e-5 and factor.max() <= 1.5 + 1e-5
    assert factor.min() < 1.02 and factor.max() > 1.48


def test_values_are_those_of_the_places_that_the_homography_says():
    draw = _draw(pictures=1, squares=4, area=0.25, tilt=0.2)
    square = draw(_ramp(10), 5)  # linear but for half a pixel at the border
    for n in range(4):
        for row in range(5):
            for column in range(5):
                at = torch.tensor([(column + 0.5) * 0.4 - 1, (row + 0.5) * 0.4 - 1, 1.0])
                x, y, w = draw.homography[n] @ at
                place = torch.stack([x / w, y / w])
                if place.abs().max() < 0.89:
                    assert torch.allclose(square[n, row, column], place, atol=1e-4)


def test_what_is_around_a_picture():
    squares = _draw(pictures=1, tilt=0.5)(torch.zeros(1, 32, 32, 3), 32)
    assert squares[0, 0, 0].tolist() == [1, 1, 1] and squares[0, 16, 16].tolist() == [0, 0, 0]
    grey = _draw(pictures=1, tilt=0.5)(torch.zeros(1, 32, 32, 3), 32, fill=0.25)
    assert grey[0, 0, 0].tolist() == [0.25] * 3


def test_large_pictures_are_reduced_without_aliasing():
    stripes = torch.arange(64).remainder(2).float()[None, None, :, None].expand(1, 64, 64, 1)
    squares = _draw(pictures=1, tilt=0.0)(stripes, 16)
    assert squares[0, 2:-2, 2:-2].sub(0.5).abs().max() < 0.05


def test_it_does_the_same_to_every_batch():
    draw, pictures = _draw(pictures=2, squares=3, area=0.2), torch.rand(2, 32, 32, 3)
    assert torch.equal(draw(pictures, 8), draw(pictures.clone(), 8))
    again = _draw(pictures=2, squares=3, area=0.2)
    assert torch.equal(again(pictures, 8), draw(pictures, 8))
    assert not torch.equal(_draw(1, pictures=2, squares=3, area=0.2)(pictures, 8), draw(pictures, 8))


@pytest.mark.parametrize("size", [6, 20])
def test_its_gradient(size):
    draw = _draw(pictures=1, squares=2, area=0.5, tilt=0.3)
    pictures = torch.rand(1, 12, 12, 1, generator=torch.Generator().manual_seed(0), requires_grad=True)
    weights = torch.rand(2, size, size, 1, generator=torch.Generator().manual_seed(1))
    (draw(pictures, size) * weights).sum().backward()
    step = torch.zeros_like(pictures)
    step[0, 5, 6] = 1.0  # it is linear, so that any step will do
    with torch.no_grad():
        change = ((draw(pictures + step, size) - draw(pictures, size)) * weights).sum()
    assert pictures.grad is not None
    assert change.item() == pytest.approx(pictures.grad[0, 5, 6].item(), abs=1e-4)
