"""The automaton's mesh: how fine it is, and where points of the base mesh are on it."""

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh, grid, icosphere, scattered_sphere, subdivide_loop, subdivide_midpoint
from mitex.methods.nca import cells
from mitex.methods.nca.cells import Cells, check, scale_of_width
from tests.methods.nca.brute_force import patchwork


def _points(mesh: Mesh, rng, count=300):
    face = rng.integers(len(mesh.faces), size=count).astype(np.int32)
    return face, rng.dirichlet(np.ones(3), count).astype(np.float32)


def _places(mesh: Mesh, face, barycentric):
    return interpolate(barycentric, mesh.vertices[mesh.faces[face]])


@pytest.mark.parametrize("levels", range(4))
@pytest.mark.parametrize("mesh", [icosphere(2), patchwork()], ids=["sphere", "patchwork"])
def test_points_of_the_given_mesh_on_its_subdivision(mesh, levels, rng):
    """At the same places; vertices of the base mesh come first among the cells."""
    own = Cells.of(mesh, levels)
    assert own.base is mesh and own.levels == levels
    assert np.array_equal(own.mesh.vertices, subdivide_midpoint(mesh, levels).vertices)
    face, barycentric = _points(mesh, rng)
    located = own.locate(face, barycentric)
    assert located[0].dtype == np.int32 and located[1].dtype == np.float32
    np.testing.assert_allclose(_places(own.mesh, *located), _places(mesh, face, barycentric), atol=1e-5)


def test_texels_a_little_outside_stay_there(rng):
    """Weights below 0, as in a chart's padding, lead to the same place beyond the face."""
    mesh = icosphere(2)
    face, barycentric = _points(mesh, rng)
    barycentric = (1.06 * barycentric - 0.02).astype(np.float32)
    own = Cells.of(mesh, 2)
    np.testing.assert_allclose(
        _places(own.mesh, *own.locate(face, barycentric)), _places(mesh, face, barycentric), atol=1e-5
    )


def test_dense_cells_are_the_mesh_that_is_textured(rng):
    mesh = icosphere(2)
    own = Cells.dense(mesh, 2)
    assert own.mesh is own.base and own.levels == 0
    assert np.array_equal(own.mesh.vertices, subdivide_loop(mesh, 2).vertices)
    face, barycentric = _points(own.mesh, rng)
    located = own.locate(face, barycentric)
    assert np.array_equal(located[0], face) and np.array_equal(located[1], barycentric)


def test_a_remeshed_copy_has_the_nearest_points(rng):
    pytest.importorskip("pymeshlab")
    mesh = icosphere(6)
    own = Cells.of(mesh, 0, 0.6)
    assert own.levels is None and own.base is mesh
    assert len(own.mesh.vertices) == pytest.approx(362 / 0.36, rel=0.15)
    face, barycentric = _points(mesh, rng)
    located = own.locate(face, barycentric)
    assert located[0].dtype == np.int32 and located[1].dtype == np.float32
    moved = np.linalg.norm(_places(own.mesh, *located) - _places(mesh, face, barycentric), axis=1)
    assert moved.max() < 0.03


@pytest.mark.parametrize(
    ("vertices", "levels"), [(8_000, 0), (7_999, 1), (2_000, 1), (1_999, 2), (12, 5), (4, 6)]
)
def test_automatic_levels(monkeypatch, vertices, levels):
    """As many as it takes to have 8,000, and never more than six."""
    mesh = (
        scattered_sphere(vertices)
        if vertices < 3000
        else Mesh(np.zeros((vertices, 3)), np.array([[0, 1, 2]]))
    )
    assert cells.ENOUGH_VERTICES == 8_000
    assert check(mesh, "auto", 1.0) == levels


@pytest.mark.parametrize(
    ("subdivide", "scale", "problem"),
    [
        (-1, 1.0, "subdivide = -1"),
        (7, 1.0, "subdivide = 7"),
        ("much", 1.0, "subdivide = much"),
        (1.5, 1.0, "subdivide = 1.5"),
        (0, 0.04, "`scale` 0.04 is out of range"),
        (0, 20.1, "`scale` 20.1 is out of range"),
        (0, float("nan"), "`scale` nan is out of range"),
        (6, 1.0, "more than 4,000,000 vertices"),
        (0, 0.05, "more than 4,000,000 vertices"),
    ],
)
def test_limits(subdivide, scale, problem):
    """Before anything is subdivided."""
    mesh = icosphere(32)
    for make in (Cells.of, Cells.dense):
        with pytest.raises(ConfigError, match=problem):
            make(mesh, subdivide, scale)


def test_a_smaller_pattern_has_as_many_more_cells():
    """Which counts for the limit; a larger one has fewer, and counts as none."""
    mesh = icosphere(32)
    assert check(mesh, 4, 1.0) == 4 and check(mesh, 4, 20.0) == 4
    with pytest.raises(ConfigError, match="more than"):
        check(mesh, 4, 0.5)


@pytest.mark.parametrize(("size", "levels"), [(1, 0), (50, 0), (1, 2)])
def test_scale_of_an_exemplar_on_a_square(monkeypatch, size, levels):
    """V even triangles' vertices on a square of side 1 are sqrt(2 / sqrt(3) / V) apart."""
    monkeypatch.setattr(cells, "with_layout", lambda mesh, resolution: mesh)  # the square fills its layout
    mesh = grid(9, 9)
    mesh = mesh.with_vertices(size * mesh.vertices)
    apart = (2 / 3**0.5 / (100 * 4**levels)) ** 0.5
    assert scale_of_width(mesh, 0.5, 32.0, levels) == pytest.approx(0.5 / (32 * apart))


def test_scale_of_an_exemplar_is_in_proportion():
    """To its width, and to the inverse of the cells along it; more cells on the mesh are as much nearer."""
    mesh = icosphere(3)
    scale = scale_of_width(mesh, 0.5, 32.0, 0)
    assert scale_of_width(mesh, 1.5, 32.0, 0) == pytest.approx(3 * scale)
    assert scale_of_width(mesh, 0.5, 8.0, 0) == pytest.approx(4 * scale)
    assert scale_of_width(mesh, 0.5, 32.0, 2) == pytest.approx(4 * scale)
