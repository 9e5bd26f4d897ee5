"""Views of a texture at two times, the motion between them, and how long it stays a few pixels."""

from dataclasses import replace

import numpy as np
import pytest
import scipy.ndimage
import torch

from mitex.mesh import icosphere
from mitex.methods.nca.motion.tangent_field import TangentField, turned_field
from mitex.methods.nca.motion.views import RIM, MotionViews, mesh_views, plane_views
from mitex.methods.nca.surfaces import CloseUps, TrainingMesh, TrainingPlane
from mitex.scenes.cameras import random_views
from tests.methods.nca.tiny import SHAPE, texture

SHARE = 0.2  # of the period: small, so that differences of grey values tell the motion


@pytest.fixture(scope="module")
def look():
    """With states that are smooth between the cells, and no grain."""
    return texture(shape=replace(SHAPE, coordinates=())).look


def _assert_moving(
    views: MotionViews, field: TangentField, state: torch.Tensor, size: tuple[int, int, int]
) -> None:
    """Grey values change by the target's share times their slope, with the opposite sign."""
    pictures = views.grey(state), views.grey(field.advection(SHARE)(state))
    assert pictures[0].shape == pictures[1].shape == (size[0], 1, *size[1:])
    assert views.target.shape == (size[0], 2, *size[1:]) and views.mask.shape == size
    first, second = (grey[:, 0].detach().numpy() for grey in pictures)
    down, right = np.gradient((first + second) / 2, axis=(1, 2))
    x, y = SHARE * views.target.numpy().transpose(1, 0, 2, 3)
    expected, change = -(x * right + y * down), second - first
    inner = views.mask.numpy().copy()
    for axis in (1, 2):  # away from the border of the surface
        inner &= np.roll(views.mask.numpy(), 1, axis) & np.roll(views.mask.numpy(), -1, axis)
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
    field = TangentField(plane, np.tile(np.array([1.5, 1.0]) @ plane.axes, (len(places), 1)))
    state = _state(places.round(9))
    windows = plane.places(CloseUps(16, 3, 40), torch.Generator().manual_seed(0))
    views = plane_views(look, field, windows)
    _assert_moving(views, field, state, (3, 40, 40))
    assert torch.allclose(views.target[:, 0], torch.tensor(1.5 * 40 / 16))
    assert torch.allclose(views.target[:, 1], torch.tensor(-1.0 * 40 / 16))


@pytest.mark.parametrize("views", ["patch", "full"])
def test_views_of_a_sphere(look, views):
    sphere, generator = TrainingMesh.of(icosphere(16), look), torch.Generator().manual_seed(1)
    field = TangentField(sphere, turned_field(sphere.mesh, "about-x", np.eye(3)))
    state = _state(2 * sphere.mesh.vertices.astype(np.float64))
    cameras = sphere.cameras(CloseUps(8, 2, 40), generator)
    if views == "full":
        cameras = random_views(generator, 2, 2.0, 60.0, 40)
    seen = mesh_views(look, field, cameras)
    _assert_moving(seen, field, state, (2, 40, 40))
    assert seen.mask.all() == (views == "patch")
    if views == "full":
        _assert_without_rim(seen.mask.numpy(), sphere.stage.hits(cameras).hit.view(2, 40, 40).numpy())


def _assert_without_rim(mask: np.ndarray, surface: np.ndarray) -> None:
    """All that the surface covers, but for what is within `RIM` pixels of the background, row or column."""
    for shown, covered in zip(mask, surface, strict=True):
        padded = np.pad(covered, RIM, "edge")
        distance = np.asarray(scipy.ndimage.distance_transform_cdt(padded, "chessboard"))
        assert np.array_equal(shown, distance[RIM:-RIM, RIM:-RIM] > RIM)
        assert 0 < shown.sum() < covered.sum()


@pytest.mark.parametrize(
    ("pixels", "period", "steps"), [(4.0, 24.0, 19), (4.0, 6.0, 4), (0.1, 6.0, 1), (10.0, 6.5, 13)]
)
def test_steps_in_which_nothing_moves_farther(pixels, period, steps):
    """The longest of the surface's, which is 5 pixels in a period, counts, and what is beside it does not."""
    target = torch.zeros(2, 2, 3, 3)
    target[0, :, 1, 1], target[1, 0, 2, 2], target[1, 1, 0, 0] = torch.tensor([3.0, -4.0]), 1.0, 100.0
    mask = torch.ones(2, 3, 3, dtype=torch.bool)
    mask[1, 0, 0] = False
    views = MotionViews(torch.clone, target, mask)
    assert views.steps_within(pixels, period) == steps
    assert steps == 1 or steps / period * 5 <= pixels < (steps + 1) / period * 5


def test_what_does_not_move_stays_within_any_steps():
    views = MotionViews(torch.clone, torch.zeros(1, 2, 3, 3), torch.ones(1, 3, 3, dtype=torch.bool))
    assert views.steps_within(4.0, 12.0) > 10_000
