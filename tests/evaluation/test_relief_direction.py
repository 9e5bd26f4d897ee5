"""The angle of ridges to a field, where it is known."""

import numpy as np
import pytest

from mitex.errors import MeshError
from mitex.evaluation.relief_direction import relief_direction
from mitex.geometry.vectors import unit
from mitex.mesh import Mesh, grid, icosphere, torus
from mitex.mesh.fields import vector_field
from mitex.methods.geometric.references import find_reference


def waves(angle: float) -> tuple[Mesh, Mesh]:
    """A plane, and ridges on it that run at an angle [degrees] to x."""
    flat, turn = grid(60, 60), np.radians(angle)
    across = np.array([-np.sin(turn), np.cos(turn), 0.0])
    points = flat.vertices.astype(np.float64)
    height = 0.03 * np.cos(20 * points @ across)
    return flat, flat.with_vertices(points + height[:, None] * [0, 0, 1])


@pytest.mark.parametrize("angle", [0, 30, 60, 90, -45])
def test_ridges_on_a_plane(angle):
    measured = relief_direction(*waves(angle), vector_field(grid(60, 60), "right"))
    assert abs((measured.turn - angle + 90) % 180 - 90) < 1.5
    assert measured.error == pytest.approx(abs(angle), abs=1.5) and measured.coherence > 0.85


def test_neither_sign_nor_length_of_the_field_counts():
    base, relief = waves(20)
    field = vector_field(base, "right")
    a, b = (relief_direction(base, relief, f) for f in (field, -3 * field))
    assert a.turn == pytest.approx(b.turn, abs=1e-4) and a.error == pytest.approx(b.error, abs=1e-4)


def test_ridges_around_a_torus():
    """Along the ring on a curved surface, and across it by a field that is turned."""
    base = torus(160, 80, tube=0.4)
    points = base.vertices.astype(np.float64)
    around = np.arctan2(points[:, 1], np.hypot(points[:, 0], points[:, 2]) - 1)
    relief = base.with_vertices(points + 0.03 * np.cos(8 * around)[:, None] * base.normals)
    field = vector_field(base, "about-y")
    assert relief_direction(base, relief, field).error < 3
    assert relief_direction(base, relief, np.cross(base.normals, field)).error > 87


def test_a_relief_without_a_direction():
    base, rng = icosphere(40), np.random.default_rng(0)
    relief = base.with_vertices(base.vertices * (1 + 0.02 * rng.normal(size=(len(base.vertices), 1))))
    measured = relief_direction(base, relief, vector_field(base, "up"))
    assert 40 < measured.error < 50 and measured.coherence < 0.1


@pytest.mark.parametrize(
    ("name", "low", "high"), [("cactus", 0, 8), ("shingles", 60, 90), ("bricks", 55, 90), ("knobs", 35, 55)]
)
def test_references(name, low, high):
    """Ribs run along `up`, rows of shingles across it, and knobs neither."""
    relief = find_reference(name)
    base = relief.with_vertices(unit(relief.vertices))
    assert low <= relief_direction(base, relief, vector_field(base, "up")).error <= high


def test_nothing_displaced_is_refused():
    with pytest.raises(MeshError, match="grid has no relief where the field has a direction"):
        relief_direction(grid(3, 3), grid(3, 3), np.ones((16, 3)))


def test_other_faces_are_refused():
    with pytest.raises(MeshError, match="differ in their faces"):
        relief_direction(grid(3, 3), grid(3, 4), np.ones((16, 3)))
