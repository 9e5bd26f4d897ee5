"""Points on surfaces: everywhere alike, and Poisson-disk sets."""

import numpy as np
import pytest

from mitex.errors import MeshError
from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh, grid
from mitex.mesh.sampling import FILL, apart, disk_count, disk_distance, random_points

PLACES = 4000


def test_places_are_as_likely_as_their_area(rng: np.random.Generator):
    """On triangles of areas 1 and 3; barycentric coordinates have mean and variance of Dirichlet's."""
    corners = [[0, 0, 0], [1, 0, 0], [0, 2, 0], [5, 0, 0], [8, 0, 0], [5, 2, 0]]
    mesh = Mesh(np.array(corners, float), np.array([[0, 1, 2], [3, 4, 5]]))
    faces, weights = random_points(mesh, PLACES, rng)
    assert (faces == 1).mean() == pytest.approx(0.75, abs=0.03)
    assert np.allclose(weights.sum(1), 1) and (weights >= 0).all()
    assert weights.mean(0) == pytest.approx(1 / 3, abs=0.01)
    assert weights.var(0) == pytest.approx(1 / 18, rel=0.08)


def test_surfaces_without_area_are_refused(rng: np.random.Generator):
    with pytest.raises(MeshError, match="flat has no area to place anything on; give a surface"):
        random_points(Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]), name="flat"), 5, rng)


def test_points_apart_are_those_of_a_slow_loop(rng: np.random.Generator):
    points = rng.random((300, 3))
    selection: list[int] = []
    for index, point in enumerate(points):
        if all(np.linalg.norm(points[other] - point) > 0.2 for other in selection):
            selection.append(index)
    assert apart(points, 0.2).tolist() == selection
    assert apart(points, 0.2, most=7).tolist() == selection[:7]
    assert apart(points, 0.2, most=0).tolist() == []


def test_both_sides_of_a_thin_part_have_points():
    points = np.array([[0, 0, 0], [0, 0, 0.01], [0.1, 0, 0]], float)
    normals = np.array([[0, 0, -1], [0, 0, 1], [0, 0, -1]], float)
    assert apart(points, 0.5).tolist() == [0]
    assert apart(points, 0.5, normals).tolist() == [0, 1]


def test_a_saturated_set_has_the_expected_number(rng: np.random.Generator):
    mesh = grid(4, 4)
    area = float(mesh.face_areas.sum())
    distance = disk_distance(area, 200)
    assert disk_count(area, distance) == pytest.approx(200) and distance == pytest.approx(
        (FILL * area / 200) ** 0.5
    )
    faces, weights = random_points(mesh, 30 * 200, rng)
    assert len(apart(interpolate(weights, mesh.vertices[mesh.faces[faces]]), distance)) == pytest.approx(
        200, rel=0.1
    )
