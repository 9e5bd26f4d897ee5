"""The form of a relief, wherever things are, however large, and however fine the mesh."""

import numpy as np
import pytest

from mitex.errors import ImageError
from mitex.evaluation import form
from mitex.evaluation.form import ReliefForm
from mitex.evaluation.surface_statistics import statistic_distances
from mitex.mesh import Mesh, grid, icosphere

DENSE, SPARSE = 30, 15


def _sphere(frequency: int, height) -> Mesh:
    ball = icosphere(frequency)
    points = ball.vertices.astype(np.float64)
    return ball.with_vertices(points * (1 + height(points))[:, None])


def _domes(points: np.ndarray, size: float = 1.0) -> np.ndarray:
    """Domes that stand apart, about 60 for size 1."""
    k = np.arange(round(60 / size**2))
    y = 1 - (2 * k + 1) / len(k)
    angle, ring = k * np.pi * (3 - 5**0.5), np.sqrt(1 - y * y)
    centres = np.stack([ring * np.sin(angle), y, ring * np.cos(angle)], 1)
    distance = np.arccos(np.clip(points @ centres.T, -1, 1)).min(1) / (0.16 * size)
    return 0.12 * size * np.sqrt(np.clip(1 - distance**2, 0, 1))


def _waves(points: np.ndarray) -> np.ndarray:
    """Round hills that run into each other, as steep as the domes in the mean."""
    return 0.055 * np.sin(12 * points).sum(1)


@pytest.fixture(scope="module", autouse=True)
def small():
    with pytest.MonkeyPatch.context() as patch:
        for name, value in {
            "PATCHES": 4,
            "PIXELS": 48,
            "SIZES": (0.5, 1.0),
            "LAYERS": ("relu2_2", "relu3_1"),
        }.items():
            patch.setattr(form, name, value)
        yield


@pytest.fixture(scope="module")
def reference():
    return _sphere(DENSE, _domes)


@pytest.fixture(scope="module")
def of_reference(reference):
    return ReliefForm(reference)


def test_the_reference_itself_and_a_plane(of_reference, reference):
    itself = of_reference.of(reference)
    assert itself.distance == pytest.approx(0, abs=1e-3) and itself.size == 1.0
    assert of_reference.at(grid(4, 4), 0.25).distance == pytest.approx(1, abs=0.05)


def test_another_cut_is_nearer_than_hills_and_hills_are_nearer_than_nothing(of_reference, reference):
    """Local statistics see it the other way round: a coarser mesh of the same form is far from it."""
    cut, hills, ball = _sphere(SPARSE, _domes), _sphere(DENSE, _waves), icosphere(DENSE)
    near, far, plain = (of_reference.of(mesh).distance for mesh in (cut, hills, ball))
    assert near < 0.75 * far and far < 0.9 * plain
    of_cut, of_hills = (statistic_distances(mesh, reference)["dihedral"] for mesh in (cut, hills))
    assert of_cut > of_hills


def test_the_coarse_distance_is_that_of_the_last_layer(of_reference, reference, monkeypatch):
    hills = _sphere(DENSE, _waves)
    both = of_reference.at(hills)
    monkeypatch.setattr(form, "LAYERS", form.LAYERS[-1:])
    alone = ReliefForm(reference).at(hills)
    assert alone.distance == alone.coarse == pytest.approx(both.coarse) and both.coarse != both.distance


def test_where_and_how_large_the_mesh_is_does_not_matter(of_reference, reference):
    moved = reference.with_vertices(0.1 * reference.vertices + 5)
    assert of_reference.at(moved).distance == pytest.approx(0, abs=0.05)


def test_the_size_of_the_relief_comes_out(of_reference):
    half = of_reference.of(_sphere(DENSE, lambda points: _domes(points, 0.5)))
    assert half.size == 0.5 and half.distance < 0.5


def test_other_places_give_another_distance(of_reference, reference):
    assert 0.02 < of_reference.at(reference, seed=1).distance < 0.4


def test_a_thread_shows_nothing(of_reference, reference):
    thread = reference.with_vertices(reference.vertices * np.array([1, 1e-3, 1e-3]))
    with pytest.raises(ImageError, match="less thin"):
        of_reference.of(thread)
