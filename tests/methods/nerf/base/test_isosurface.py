"""Marching cubes: in place, closed, faces outwards."""

import sys

import numpy as np
import pytest

from mitex.errors import MissingPackage
from mitex.mesh import quality
from mitex.methods.nerf.base.isosurface import isosurface, without_cavities

CELL = 0.1
LOW = np.array([-1.0, -2.0, -3.0])


def balls(radius: float, inner: float = 0.0, count: int = 30) -> np.ndarray:
    """Distances to a sphere around the middle of the grid, positive inside; less an inner sphere."""
    r = np.linalg.norm(np.indices((count,) * 3) - 0.5 * (count - 1), axis=0) * CELL
    return np.minimum(radius - r, r - inner).astype(np.float32)


def volume(mesh) -> float:
    return float((mesh.vertices[mesh.faces[:, 0]] * mesh.face_crosses).sum() / 6)


def test_a_sphere_is_where_it_should_be():
    mesh = isosurface(balls(1.2), 0.0, low=LOW, cell=CELL, name="ball")
    centre = LOW + 0.5 * CELL * 29
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices - centre, axis=1), 1.2, atol=0.01)
    assert volume(mesh) == pytest.approx(4 / 3 * np.pi * 1.2**3, rel=0.01)
    assert quality(mesh).genus == 0 and mesh.name == "ball"


def test_it_closes_at_the_border_of_the_grid():
    mesh = isosurface(balls(2.0), 0.0, low=LOW, cell=CELL)
    assert quality(mesh).boundary_edges == 0
    assert volume(mesh) > 0


def test_cavities_are_filled():
    hollow = balls(1.2, inner=0.6)
    assert quality(isosurface(hollow, 0.0, low=LOW, cell=CELL)).components == 2
    filled = isosurface(without_cavities(hollow, 0.0), 0.0, low=LOW, cell=CELL)
    assert quality(filled).components == 1
    assert volume(filled) == pytest.approx(4 / 3 * np.pi * 1.2**3, rel=0.01)


def test_open_hollows_stay():
    values = balls(1.2, inner=0.6)
    values[15:, 14:16, 14:16] = -1.0
    np.testing.assert_array_equal(without_cavities(values, 0.0), values)


def test_names_the_extra_that_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "skimage.measure", None)
    with pytest.raises(MissingPackage, match=r"pip install 'mitex\[nerf\]'"):
        isosurface(balls(1.0), 0.0, low=LOW, cell=CELL)
