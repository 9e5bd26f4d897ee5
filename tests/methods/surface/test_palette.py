"""Distributions of colours, of pixels and of whole stones."""

import numpy as np
import pytest
import torch

from mitex.mesh import grid
from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.palette import DIRECTIONS, Palette, sliced_distance
from mitex.methods.surface.tile import tile_levels
from mitex.training import resolve
from tests.methods.surface.test_scale import square_levels

SIDE, STONE = 256, 40  # [px]; a sixteenth of the side is compared, wherever it lies


@pytest.fixture(scope="module")
def levels():
    return tile_levels(SIDE, 5)


def stones(seed=0, hue=0.02):
    """(SIDE, SIDE, 3) squares of one colour each, which differ most in brightness, with a little noise."""
    generator = torch.Generator().manual_seed(seed)
    count = -(-SIDE // STONE)
    brightness = 0.3 + 0.4 * torch.rand(count, count, 1, generator=generator)
    colours = brightness + hue * (torch.rand(count, count, 3, generator=generator) - 0.5)
    image = colours.repeat_interleave(STONE, 0).repeat_interleave(STONE, 1)[:SIDE, :SIDE]
    return image + 0.02 * (torch.rand(image.shape, generator=generator) - 0.5)


def on_texels(image, levels):
    return image.reshape(-1, 3)[levels.order]


def test_directions_are_spread_evenly():
    assert torch.allclose(DIRECTIONS @ DIRECTIONS.T, 2 * torch.eye(3), atol=1e-6)
    assert torch.allclose((DIRECTIONS.T @ DIRECTIONS).abs() + 0.0, _axes_of_an_icosahedron(), atol=1e-6)


def _axes_of_an_icosahedron():
    return torch.eye(6) + (1 - torch.eye(6)) / 5**0.5


def test_the_distance_along_an_axis_is_the_mean_of_squared_shifts():
    values = torch.rand(400, 2, generator=torch.Generator().manual_seed(0))
    shuffled = values[torch.randperm(400, generator=torch.Generator().manual_seed(1))]
    shift = torch.tensor([0.3, -0.1])
    assert float(sliced_distance(shuffled, values)) < 1e-12
    assert abs(float(sliced_distance(shuffled + shift, values)) - 0.05) < 1e-6
    ramp = torch.linspace(0, 1, 1000)[:, None]
    assert abs(float(sliced_distance(2 * ramp[::7], ramp)) - 1 / 3) < 1e-2  # of other numbers of values


def test_stones_in_another_order_are_the_same_but_their_mean_is_not(levels):
    """Shuffled pixels have the right colours one by one, but only their mean is left of squares."""
    image = stones(hue=0.2)
    palette = Palette(levels, image[None])
    moved = torch.roll(image.flip(0), (16, 32), (0, 1))
    shuffled = image.reshape(-1, 3)[torch.randperm(SIDE**2, generator=torch.Generator().manual_seed(0))]
    distances = [
        float(palette.distance(on_texels(x, levels), 0)) for x in (image, moved, shuffled.view(image.shape))
    ]
    assert distances[0] < 0.03 and distances[1] < 0.03 and 0.4 < distances[2] < 0.9


def test_of_squares_hue_counts_as_much_as_brightness(levels):
    """It is two of three dimensions; of texels it counts as much as it is spread."""
    image = stones(hue=0.1)
    palette = Palette(levels, image[None])
    grey = image.mean(2, keepdim=True).expand(-1, -1, 3)
    lost = float(palette.distance(on_texels(grey, levels), 0))
    assert 0.2 < lost < 0.8


def test_its_gradient_leads_to_the_colours(levels):
    palette = Palette(levels, stones()[None])
    colours = on_texels(stones(seed=1) * 0.5 + 0.2, levels).requires_grad_()
    before = palette.distance(colours, 0)
    (gradient,) = torch.autograd.grad(before, colours)
    step = 0.1 * before.detach() / gradient.square().sum()
    after = palette.distance((colours - step * gradient).detach(), 0)
    assert float(after) == pytest.approx(0.9 * float(before.detach()), rel=0.02)


def test_squares_of_a_large_exemplar_need_deeper_levels():
    """A sixteenth of 1,024 texels is six poolings wide: with five, squares are a thirty-second."""
    image = torch.rand(1024, 1024, 3, generator=torch.Generator().manual_seed(0))
    for depth, squares in ((5, 32**2), (6, 16**2)):
        texels, whole = Palette(tile_levels(1024, depth), image[None]).groups[1]
        assert len(whole) == squares and int(texels.max()) + 1 == squares
    assert SurfaceDomain.of(grid(1, 1), resolve(PRESETS, None, None, ["resolution=2048"])).depth == 6


@pytest.mark.parametrize("step", [0.5, 1.0, 2.0])
def test_squares_are_whole_where_the_pattern_is_larger_or_smaller(step):
    """On a flat square whose taps are `step` texels apart, most groups count as whole."""
    _, widths, levels = square_levels(lambda position: np.full(len(position), step))
    image = torch.rand(64, 64, 3, generator=torch.Generator().manual_seed(0))
    palette = Palette(levels, image[None], 0, torch.from_numpy(widths.astype(np.float32)))
    parent, whole = palette.groups[1]
    share = torch.isin(parent, whole).float().mean()
    assert share > 0.8 and len(palette.groups[0][1]) == len(widths)
