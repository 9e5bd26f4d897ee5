"""Pictures of the same places at two times, and the motion between them."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.mesh import icosphere
from mitex.methods.nca.motion.drift import Drift, turned_field
from mitex.methods.nca.motion.pairs import Pairs, plane_pairs, sphere_pairs
from mitex.methods.nca.surfaces import CloseUps, TrainingPlane, TrainingSphere
from mitex.scenes.cameras import random_views
from tests.methods.nca.tiny import SHAPE, texture

SHARE = 0.2  # of the period: small, so that differences of grey values tell the motion


@pytest.fixture(scope="module")
def look():
    """With states that are smooth between the cells, and no grain."""
    return texture(shape=replace(SHAPE, coordinates=())).look


def _assert_moving(pairs: Pairs, size: tuple[int, int, int]) -> None:
    """Grey values change by the target's share times their slope, with the opposite sign."""
    assert pairs.first.shape == pairs.second.shape == (size[0], 1, *size[1:])
    assert pairs.target.shape == (size[0], 2, *size[1:]) and pairs.mask.shape == size
    first, second = (grey[:, 0].detach().numpy() for grey in (pairs.first, pairs.second))
    down, right = np.gradient((first + second) / 2, axis=(1, 2))
    x, y = SHARE * pairs.target.numpy().transpose(1, 0, 2, 3)
    expected, change = -(x * right + y * down), second - first
    inner = pairs.mask.numpy().copy()
    for axis in (1, 2):  # away from the border of the surface
        inner &= np.roll(pairs.mask.numpy(), 1, axis) & np.roll(pairs.mask.numpy(), -1, axis)
    inner[:, [0, -1]], inner[:, :, [0, -1]] = False, False
    assert inner.mean() > 0.2
    change, expected = change[inner], expected[inner]
    factor = (change * expected).sum() / (expected**2).sum()
    assert factor == pytest.approx(1, abs=0.05)
    assert np.linalg.norm(change - expected) < 0.35 * np.linalg.norm(change)


def _state(places: np.ndarray) -> torch.Tensor:
    waves = [0.4 * np.sin(places @ direction) for direction in ([3, 2, 1], [-1, 4, 2], [2, -1, 4])]
    return torch.from_numpy(np.stack([*waves, *[0 * waves[0]] * 13], 1)).float()


def test_windows_of_a_square(look):
    plane = TrainingPlane.of(32, look, 0.5 * np.pi)
    places = (2 * np.pi / 32) * plane.lattice.mesh.vertices[: plane.lattice.count].astype(np.float64)
    drift = Drift(plane, np.tile(np.array([1.5, 1.0]) @ plane.axes, (len(places), 1)))
    state = _state(places.round(9))
    windows = plane.places(CloseUps(16, 3, 40), torch.Generator().manual_seed(0))
    pairs = plane_pairs(look, (state, drift.advection(SHARE)(state)), drift, windows)
    _assert_moving(pairs, (3, 40, 40))
    assert torch.allclose(pairs.target[:, 0], torch.tensor(1.5 * 40 / 16))
    assert torch.allclose(pairs.target[:, 1], torch.tensor(-1.0 * 40 / 16))


@pytest.mark.parametrize("views", ["patch", "full"])
def test_views_of_a_sphere(look, views):
    sphere, generator = TrainingSphere.of(icosphere(16), look), torch.Generator().manual_seed(1)
    drift = Drift(sphere, turned_field(sphere.mesh, "about-x", np.eye(3)))
    state = _state(2 * sphere.mesh.vertices.astype(np.float64))
    cameras = sphere.cameras(CloseUps(8, 2, 40), generator)
    if views == "full":
        cameras = random_views(generator, 2, 2.0, 60.0, 40)
    pairs = sphere_pairs(look, (state, drift.advection(SHARE)(state)), drift, cameras)
    _assert_moving(pairs, (2, 40, 40))
    assert pairs.mask.all() == (views == "patch")
