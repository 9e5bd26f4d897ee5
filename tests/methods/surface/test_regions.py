"""Regions are compact on real surfaces, whatever the settings."""

from functools import cache

import numpy as np
import pytest
import torch
from scipy.spatial.distance import pdist

from mitex.features import Vgg16
from mitex.mesh import Mesh, icosphere, torus
from mitex.methods.layout import with_layout
from mitex.methods.surface.comparison import GramComparison
from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.network import SurfaceVgg
from mitex.methods.surface.regions import bisect
from mitex.training import resolve

pytestmark = pytest.mark.usefixtures("own_cache")
LAYERS = ("relu1_1", "pool1")


@pytest.mark.parametrize("count", [1, 2, 7, 32])
def test_parts_are_a_partition_into_equal_numbers(rng, count):
    parts = bisect(rng.normal(size=(1000, 3)), count)
    assert len(parts) == count
    assert np.array_equal(np.sort(np.concatenate(parts)), np.arange(1000))
    sizes = [len(part) for part in parts]
    assert max(sizes) - min(sizes) <= 5
    assert all((np.diff(part) > 0).all() for part in parts)


def test_parts_do_not_depend_on_the_units_or_the_order(rng):
    points, order = rng.normal(size=(500, 3)), rng.permutation(500)
    parts = {frozenset(part) for part in bisect(points, 6)}
    assert {frozenset(order[part]) for part in bisect(1e-6 * points[order], 6)} == parts


MESHES = {"sphere": icosphere(12), "ring": torus(96, 10, 1.0, 0.12)}


@cache
def laid_out(name: str, resolution: int) -> Mesh:
    """The mesh with the UVs of a fit, which take seconds."""
    config = resolve(PRESETS, overrides=[f"resolution={resolution}"])
    return with_layout(MESHES[name], config.resolution)


def _cases(mesh: str, side: int) -> list[tuple[str, str]]:
    settings = (
        f"style resolution={side} exemplar_size={side // 4}",
        f"fast resolution={side} exemplar_size={side // 4}",
        f"fast resolution={side} exemplar_size={side // 8} scales=0",
        "paper resolution=128 exemplar_size=32 region=0.5",
    )
    return [(mesh, words) for words in settings]


# Ranges of elements would be too wide on a ball from these resolutions on, on a ring from lower ones.
@pytest.mark.parametrize(("mesh", "settings"), _cases("sphere", 256) + _cases("ring", 128))
def test_a_region_is_no_wider_than_two_squares_of_its_area(mesh, settings):
    """Ranges of elements in the order of the levels are up to 5.3 times as wide."""
    preset, *overrides = settings.split()
    config = resolve(PRESETS, preset, None, overrides)
    domain = SurfaceDomain.of(laid_out(mesh, config.resolution), config)
    network = SurfaceVgg(domain.levels)
    area = round((config.region * config.exemplar_size) ** 2)
    images = torch.zeros(1, 32, 32, 3)
    comparison = GramComparison(Vgg16(normalised=False), images, LAYERS, area)
    taps = comparison.taps(network, torch.Generator())
    for level, layer in enumerate(LAYERS):
        position = domain.levels.positions[level]
        regions = taps[layer].regions
        assert regions is not None
        assert np.array_equal(np.sort(torch.cat(list(regions)).numpy()), np.arange(len(position)))
        for region in regions:
            texels = len(region) * len(domain.levels.order) / len(position)
            square = np.sqrt(2 * texels) * domain.texels.size
            assert pdist(position[region][:: max(len(region) // 400, 1)]).max() < 2 * square
