"""Interpolants over triangles: what they reproduce, and how smooth they are across edges and vertices."""

import numpy as np
import pytest
import torch

from mitex.mesh import Mesh, grid, icosphere
from mitex.mesh.gradients import values_and_gradients
from mitex.textures.interpolation import SurfaceLookup
from tests.shapes import collapsed, moebius

pytestmark = pytest.mark.usefixtures("mi")
KINDS = ("linear", "smooth")


def _weights(mesh: Mesh, kind, face, barycentric):
    """Dense weights (P, rows of the table)."""
    face = torch.from_numpy(np.array(face, np.int32))
    lookup = SurfaceLookup(mesh, kind).weights(face, torch.from_numpy(np.array(barycentric, np.float32)))
    dense = np.zeros((len(face), lookup.columns))
    np.add.at(dense, (np.arange(len(face))[:, None], lookup.index.numpy()), lookup.weight.numpy())
    return dense


def _table(mesh: Mesh, values, kind):
    return values_and_gradients(mesh) @ values if kind == "smooth" else values


def _read(mesh: Mesh, kind, table, face, barycentric):
    return _weights(mesh, kind, face, barycentric) @ table


def _bent(angle: float) -> Mesh:
    """A jittered strip, folded about the y axis by an angle."""
    mesh = grid(4, 3)
    jitter = np.random.default_rng(0).uniform(-0.08, 0.08, mesh.vertices.shape) * [1, 1, 0]
    jitter[np.abs(mesh.vertices[:, 0]) < 1e-6, 0] = 0  # the fold is straight
    x, y, _ = (mesh.vertices + jitter).astype(float).T
    folded = np.where(x > 0, x * np.cos(angle), x), y, np.where(x > 0, x * np.sin(angle), 0)
    return Mesh(np.stack(folded, 1), mesh.faces)


def _uneven() -> Mesh:
    mesh, rng = icosphere(3), np.random.default_rng(1)
    return mesh.with_vertices(mesh.vertices + 0.08 * rng.normal(size=mesh.vertices.shape))


def _wheel(valence: int, height: float = 0.2) -> Mesh:
    """Faces around a vertex, at uneven angles."""
    rng = np.random.default_rng(valence)
    angle = 2 * np.pi * (np.arange(valence) + rng.uniform(-0.2, 0.2, valence)) / valence
    ring = np.column_stack([np.cos(angle), np.sin(angle), rng.uniform(-height, height, valence)])
    k = np.arange(valence)
    faces = np.column_stack([0 * k, 1 + k, 1 + (k + 1) % valence])
    return Mesh(np.concatenate([np.zeros((1, 3)), ring]), faces)


def _inner_edges(mesh: Mesh):
    """For each edge of two faces: (face, its corners at the edge's first and second vertex), of both."""
    sides: dict[tuple[int, int], list[tuple[int, int, int]]] = {}
    for face, corners in enumerate(mesh.faces.tolist()):
        for k in range(3):
            i, j = (k, (k + 1) % 3) if corners[k] < corners[(k + 1) % 3] else ((k + 1) % 3, k)
            sides.setdefault((corners[i], corners[j]), []).append((face, i, j))
    return [pair for pair in sides.values() if len(pair) == 2]


def _across(mesh: Mesh, side: int, t: np.ndarray, distance: float):
    """Points at shares t of every inner edge, `distance` into one of its faces, at right angles to it.

    The distance counts in heights of the smaller of both faces, so that those of both faces belong together.
    """
    faces, barycentric = [], []
    points = mesh.vertices.astype(float)
    for pair in _inner_edges(mesh):
        heights = []
        for face, i, j in pair:
            a, b, c = points[mesh.faces[face][[i, j, 3 - i - j]]]
            along = (b - a) / np.linalg.norm(b - a)
            heights.append(np.linalg.norm((c - a) - ((c - a) @ along) * along))
        face, i, j = pair[side]
        a, b, c = points[mesh.faces[face][[i, j, 3 - i - j]]]
        share = distance * min(heights) / heights[side]  # of the way to the corner
        slip = share * ((c - a) @ (b - a)) / ((b - a) @ (b - a))
        weights = np.zeros((len(t), 3))
        weights[:, j] = t - slip
        weights[:, 3 - i - j] = share
        weights[:, i] = 1 - t + slip - share
        faces += [face] * len(t)
        barycentric.append(weights)
    return np.array(faces), np.concatenate(barycentric)


def _slope_jump(mesh: Mesh, kind, values) -> np.ndarray:
    """Sum of the slopes into both faces at points of the edges, relative to the slopes' size: 0 if smooth."""
    table, t, h = _table(mesh, values, kind), np.array([0.3, 0.5, 0.7]), 0.01
    slopes = []
    for side in (0, 1):
        f = [_read(mesh, kind, table, *_across(mesh, side, t, k * h)) for k in range(4)]
        slopes.append((-11 * f[0] + 18 * f[1] - 9 * f[2] + 2 * f[3]) / (6 * h))
    return np.abs(slopes[0] + slopes[1]) / np.abs(slopes).max()


def _random_points(mesh: Mesh, rng, each: int = 20):
    face = np.repeat(np.arange(len(mesh.faces)), each)
    return face, rng.dirichlet(np.ones(3), len(face))


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mesh", [_uneven(), _bent(1.0), _wheel(7)], ids=["closed", "bent", "wheel"])
def test_values_of_a_constant(mesh, kind, rng):
    """Weights of values sum to 1; those of slopes count nothing where there are none."""
    table = _table(mesh, np.full(len(mesh.vertices), 2.5), kind)
    np.testing.assert_allclose(_read(mesh, kind, table, *_random_points(mesh, rng)), 2.5, rtol=2e-6)
    weights = _weights(mesh, kind, *_random_points(mesh, rng))
    own = weights if kind == "linear" else weights[:, ::4]
    np.testing.assert_allclose(own.sum(1), 1, atol=2e-6)


@pytest.mark.parametrize("order", [1, 2, 3])
def test_polynomials_in_a_plane(rng, order):
    """With their own slopes at the vertices, quadratic ones are reproduced on any triangles; cubic ones are
    not, which shows that the test would tell.
    """
    mesh = _bent(0.0)
    x, y, z = mesh.vertices.astype(float).T
    powers = {1: x - 2 * y, 2: x * x - x * y + 0.5 * y * y, 3: x**3 - x * y * y}
    slopes = {
        1: (1 + 0 * x, -2 + 0 * x),
        2: (2 * x - y, y - x),
        3: (3 * x * x - y * y, -2 * x * y),
    }
    table = np.column_stack([powers[order], *slopes[order], 0 * x]).ravel()
    face, b = _random_points(mesh, rng)
    result = _read(mesh, "smooth", table, face, b)
    px, py, _ = np.einsum("pk,pkd->dp", b, mesh.vertices[mesh.faces[face]])
    expected = {1: px - 2 * py, 2: px * px - px * py + 0.5 * py * py, 3: px**3 - px * py * py}[order]
    error = np.abs(result - expected).max()
    assert error < 3e-6 if order < 3 else error > 1e-3


def test_quadratics_of_values_alone_on_an_even_mesh(rng):
    """With the slopes that the mesh gives, where all corners of a face have six faces."""
    i, j = (a.ravel() for a in np.meshgrid(np.arange(7), np.arange(7), indexing="ij"))
    x, y = j + 0.5 * i, np.sqrt(0.75) * i
    own = (np.arange(6)[:, None] * 7 + np.arange(6)).ravel()
    faces = np.concatenate([np.stack([own, own + 1, own + 7], 1), np.stack([own + 1, own + 8, own + 7], 1)])
    mesh = Mesh(np.column_stack([x, y, 0 * x]), faces)
    table = _table(mesh, 0.1 * x * x - 0.2 * x * y, "smooth")
    face, b = _random_points(mesh, rng)
    regular = np.diff(mesh.edges.indptr) == 6
    inner = regular[mesh.faces[face]].all(1)
    px, py, _ = np.einsum("pk,pkd->dp", b, mesh.vertices[mesh.faces[face]])
    error = np.abs(_read(mesh, "smooth", table, face, b) - (0.1 * px * px - 0.2 * px * py))
    assert inner.sum() > 200 and error[inner].max() < 1e-5
    assert error[~inner].max() > 1e-3


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("mesh", [_uneven(), _bent(0.9), moebius()], ids=["closed", "bent", "moebius"])
def test_both_faces_agree_on_their_edge(mesh, kind, rng):
    """To 1e-6 of the values: also where the surface is bent, and where it has one side only."""
    table = _table(mesh, rng.random(len(mesh.vertices)), kind)
    t = np.array([0.0, 0.01, 0.25, 0.5, 0.9, 1.0])
    one, other = (_read(mesh, kind, table, *_across(mesh, side, t, 0.0)) for side in (0, 1))
    assert np.abs(one - other).max() < 1e-6
    assert one.std() > 0.1


@pytest.mark.parametrize("kind", KINDS)
def test_all_faces_agree_on_their_vertices(kind, rng):
    """On what it holds, from every face; and what is near a vertex is nearly that."""
    mesh = _uneven()
    values = rng.random(len(mesh.vertices))
    table = _table(mesh, values, kind)
    face = np.repeat(np.arange(len(mesh.faces)), 3)
    corner = np.tile(np.arange(3), len(mesh.faces))
    at = mesh.faces[face, corner]
    np.testing.assert_allclose(_read(mesh, kind, table, face, np.eye(3)[corner]), values[at], atol=1e-6)
    near = 0.9999 * np.eye(3)[corner] + 0.0001 * rng.dirichlet(np.ones(3), len(face))
    assert np.abs(_read(mesh, kind, table, face, near) - values[at]).max() < 5e-4


def test_slopes_at_a_vertex_are_those_of_the_table(rng):
    """In a plane, from every face around: differentiable there too."""
    mesh = _bent(0.0)
    table = rng.normal(size=(len(mesh.vertices), 4))
    table[:, 3] = 0
    face = np.repeat(np.arange(len(mesh.faces)), 3)
    corner = np.tile(np.arange(3), len(mesh.faces))
    at, toward = mesh.faces[face, corner], rng.dirichlet(np.ones(3), len(face))
    points = mesh.vertices[mesh.faces[face]].astype(float)
    step = 0.01 * (np.einsum("pk,pkd->pd", toward, points) - mesh.vertices[at])
    f = [
        _read(mesh, "smooth", table.ravel(), face, np.eye(3)[corner] * (1 - s) + toward * s)
        for s in (0.0, 0.01, 0.02, 0.03)
    ]
    slope = (-11 * f[0] + 18 * f[1] - 9 * f[2] + 2 * f[3]) / 6
    expected = (step * table[at, 1:]).sum(1)
    assert np.abs(slope - expected).max() < 0.01 * np.abs(expected).max()


@pytest.mark.parametrize(
    "mesh", [_bent(0.0), _bent(1.1), _bent(-2.0), _uneven()], ids=["flat", "bent", "folded", "closed"]
)
def test_smooth_values_cross_edges_without_a_kink(mesh, rng):
    """In the faces' planes, unfolded; linear ones have kinks."""
    values = rng.random(len(mesh.vertices))
    smooth, linear = (_slope_jump(mesh, kind, values) for kind in ("smooth", "linear"))
    assert smooth.max() < 0.005
    assert np.median(linear) > 0.05


def test_smooth_values_inside_a_face(rng):
    """No kink there: second differences along a line shrink with the square of the step."""
    mesh = _wheel(5)
    table = _table(mesh, rng.random(6), "smooth")
    sizes = []
    for count in (41, 81):
        s = np.linspace(0.02, 0.96, count)[:, None]
        line = (1 - s) * [0.9, 0.04, 0.06] + s * [0.05, 0.9, 0.05]
        sizes.append(np.abs(np.diff(_read(mesh, "smooth", table, np.zeros(count), line), n=2)).max())
    assert sizes[0] == pytest.approx(4 * sizes[1], rel=0.15)


@pytest.mark.parametrize("kind", KINDS)
def test_the_order_of_corners_does_not_matter(kind, rng):
    mesh = _uneven()
    table = _table(mesh, rng.random(len(mesh.vertices)), kind)
    face, b = _random_points(mesh, rng, 5)
    expected = _read(mesh, kind, table, face, b)
    for turn in (1, 2):
        turned = Mesh(mesh.vertices, np.roll(mesh.faces, turn, axis=1))
        np.testing.assert_allclose(
            _read(turned, kind, table, face, np.roll(b, turn, axis=1)), expected, atol=2e-6
        )


@pytest.mark.parametrize("kind", KINDS)
def test_the_order_of_vertices_and_faces_does_not_matter(kind, rng):
    mesh = _uneven()
    vertex, order = rng.permutation(len(mesh.vertices)), rng.permutation(len(mesh.faces))
    place = np.argsort(vertex)
    other = Mesh(mesh.vertices[vertex], place[mesh.faces[order]])
    values = rng.random(len(mesh.vertices))
    face, b = _random_points(mesh, rng, 5)
    expected = _read(mesh, kind, _table(mesh, values, kind), face, b)
    result = _read(other, kind, _table(other, values[vertex], kind), np.argsort(order)[face], b)
    np.testing.assert_allclose(result, expected, atol=1e-5)


@pytest.mark.parametrize("valence", range(3, 31, 3))
def test_any_valence_and_a_boundary_stay_bounded(valence, rng):
    """Values between 0 and 1 at the vertices give little more, at corners, on sides, and a little outside."""
    mesh = _wheel(valence)
    table = _table(mesh, (rng.random((valence + 1, 30)) > 0.5).astype(float), "smooth")
    face, b = _random_points(mesh, rng)
    beyond = 1.04 * np.eye(3) - 0.02 * (1 - np.eye(3))
    outside = np.repeat(np.arange(valence), 3), np.tile(beyond, (valence, 1))
    for where in ((face, b), outside):
        values = _read(mesh, "smooth", table, *where)
        assert np.isfinite(values).all()
        assert values.min() > -0.6 and values.max() < 1.6


@pytest.mark.parametrize("size", [1e-6, 1e6])
@pytest.mark.parametrize("kind", KINDS)
def test_units_do_not_matter(kind, size, rng):
    mesh, values = _uneven(), rng.random(92)
    other = mesh.with_vertices(size * mesh.vertices.astype(float))
    face, b = _random_points(mesh, rng, 3)
    one, two = (_read(m, kind, _table(m, values, kind), face, b) for m in (mesh, other))
    np.testing.assert_allclose(one, two, atol=1e-5)


@pytest.mark.parametrize("kind", KINDS)
def test_faces_without_area_stay_bounded(kind, rng):
    """Lines, points, and a mesh that has nothing else."""
    line = Mesh(np.outer([0, 1, 3], [1, 0, 0]), np.array([[0, 1, 2], [1, 1, 1]]))
    for mesh in (collapsed(icosphere(2)), line):
        table = _table(mesh, rng.random(len(mesh.vertices)), kind)
        values = _read(mesh, kind, table, *_random_points(mesh, rng))
        assert np.isfinite(values).all() and np.abs(values).max() < 3


def test_no_points(rng):
    mesh = icosphere(1)
    for kind in KINDS:
        assert _weights(mesh, kind, np.zeros(0), np.zeros((0, 3))).shape[0] == 0


@pytest.mark.parametrize("distance", [1e-20, 1e-16, 1e-12, 1e-8])
@pytest.mark.parametrize("kind", KINDS)
def test_next_to_a_corner_is_the_value_of_the_corner(kind, distance: float):
    """Even where squares of barycentric coordinates have no place in float32."""
    mesh = _uneven()
    values = np.random.default_rng(2).normal(size=(len(mesh.vertices), 2))
    for barycentric in ((1, distance, 0), (1, distance, distance)):
        points = np.broadcast_to(barycentric, (len(mesh.faces), 3))
        result = _read(mesh, kind, _table(mesh, values, kind), np.arange(len(mesh.faces)), points)
        np.testing.assert_allclose(result, values[mesh.faces[:, 0]], atol=1e-6)
