"""Tangent frames: what every frame must satisfy, and where the fixed and the smooth field must point."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mitex.errors import ConfigError
from mitex.geometry.vectors import unit_normals
from mitex.mesh import Mesh, embedded, grid, icosphere, torus
from mitex.mesh.frames import vertex_directions
from mitex.mesh.topology import mesh_edges, welded
from tests.mesh.examples import tangent_frames

X, Y, Z = np.eye(3)


def everywhere(mesh: Mesh, rng: np.random.Generator, count: int = 500) -> tuple[np.ndarray, np.ndarray]:
    return rng.integers(0, len(mesh.faces), count), rng.dirichlet([1.0] * 3, count)


def check(right: np.ndarray, up: np.ndarray, normal: np.ndarray) -> None:
    """Orthonormal, across the normal, and not mirrored seen from outside."""
    assert right.dtype == up.dtype == np.float64
    np.testing.assert_allclose(np.linalg.norm(right, axis=1), 1.0, atol=1e-9)
    np.testing.assert_allclose(np.cross(right, up), normal, atol=1e-9)


def cylinder(rows: int = 8, around: int = 24) -> Mesh:
    """Open, around the y axis."""
    angle = np.arange(around) * (2 * np.pi / around)
    ring = np.stack([np.sin(angle), 0 * angle, np.cos(angle)], axis=1)
    points = np.concatenate([ring + k * 0.26 * Y for k in range(rows)])
    a = np.arange((rows - 1) * around)
    b = a - a % around + (a + 1) % around
    faces = np.concatenate([np.stack([a, b, b + around], 1), np.stack([a, b + around, a + around], 1)])
    return Mesh(points, faces)


def facing(normal: np.ndarray) -> Mesh:
    """A square across an axis."""
    mesh = grid(2, 2)
    turn = Rotation.align_vectors(normal[None], Z[None])[0].as_matrix()
    return mesh.with_vertices(np.rint(mesh.vertices @ turn.T))


def turning(mesh: Mesh, kind: str) -> float:
    """Mean angle between neighbouring vertices' directions, one carried to the other [rad]."""
    directions, normals = vertex_directions(mesh, kind), mesh.normals.astype(np.float64)
    pairs, _ = mesh_edges(mesh.faces, len(mesh.vertices))
    a, b = normals[pairs[:, 0]], normals[pairs[:, 1]]
    axis = np.cross(a, b)
    sine = np.linalg.norm(axis, axis=1, keepdims=True)
    angle = np.arctan2(sine, (a * b).sum(axis=1, keepdims=True))
    carried = Rotation.from_rotvec(axis / np.maximum(sine, 1e-12) * angle).apply(directions[pairs[:, 0]])
    cosine = np.clip((carried * directions[pairs[:, 1]]).sum(axis=1), -1, 1)
    return float(np.arccos(cosine).mean())


@pytest.mark.parametrize("kind", ["fixed", "smooth"])
@pytest.mark.parametrize(
    "mesh", [icosphere(6), torus(24, 12), cylinder()], ids=["sphere", "torus", "cylinder"]
)
@pytest.mark.parametrize("angle", [0.0, 2.1])
def test_frames_are_orthonormal_and_not_mirrored(mesh, kind, angle, rng):
    face, barycentric = everywhere(mesh, rng)
    right, up = tangent_frames(mesh, face, barycentric, kind, angle)
    check(right, up, unit_normals(mesh.face_crosses)[face])


@pytest.mark.parametrize("kind", ["fixed", "smooth"])
@pytest.mark.parametrize(
    ("normal", "right"),
    [(X, -Z), (-X, Z), (Z, X), (-Z, -X), (Y, X), (-Y, -X)],
    ids=["+x", "-x", "+z", "-z", "+y", "-y"],
)
def test_along_the_axes_right_is_y_cross_n_or_w_cross_n(normal, right, kind):
    mesh = facing(normal)
    face, barycentric = np.arange(8), np.full((8, 3), 1 / 3)
    np.testing.assert_allclose(unit_normals(mesh.face_crosses), np.tile(normal, (8, 1)), atol=1e-12)
    actual, up = tangent_frames(mesh, face, barycentric, kind)
    np.testing.assert_allclose(actual, np.tile(right, (8, 1)), atol=1e-9)
    check(actual, up, np.tile(normal, (8, 1)))


def test_up_is_up_on_walls(rng):
    mesh = cylinder()
    _, up = tangent_frames(mesh, *everywhere(mesh, rng))
    np.testing.assert_allclose(up, np.tile(Y, (len(up), 1)), atol=1e-9)


def test_smooth_is_fixed_where_that_is_smooth_already():
    mesh = cylinder()
    np.testing.assert_allclose(vertex_directions(mesh, "smooth"), vertex_directions(mesh, "fixed"), atol=1e-9)


@pytest.mark.parametrize("name", ["shaderball", "octopus"])
def test_smooth_turns_less(name):
    mesh = embedded(name)
    fixed, smooth = turning(mesh, "fixed"), turning(mesh, "smooth")
    assert smooth < 0.85 * fixed


def test_smooth_stays_upright_where_the_surface_is_nearly_upright():
    mesh = embedded("mushrooms")
    fixed, smooth = vertex_directions(mesh, "fixed"), vertex_directions(mesh, "smooth")
    upright = np.abs(mesh.normals[:, 1]) < 0.5
    assert upright.sum() > 1000
    assert np.median((fixed * smooth).sum(axis=1)[upright]) > np.cos(np.radians(3))


def test_smooth_has_a_direction_on_rough_level_ground(rng):
    flat = grid(20, 20)
    vertices = flat.vertices[:, [0, 2, 1]] * [1, 1, -1]
    vertices[:, 1] = 0.01 * rng.normal(size=len(vertices))
    mesh = flat.with_vertices(vertices)
    assert mesh.normals[:, 1].min() > 0.8
    smooth = vertex_directions(mesh, "smooth")
    assert (smooth @ X).min() > 0.5
    assert (vertex_directions(mesh, "fixed") @ X).min() < -0.9  # points anywhere


def test_smooth_solves_its_equations_like_a_dense_minimisation():
    """On a small sphere, the energy of the docstring, written down edge by edge, has its minimum there."""
    from mitex.mesh import frames

    mesh = icosphere(2)
    normals = mesh.normals.astype(np.float64)
    normals /= np.linalg.norm(normals, axis=1, keepdims=True)
    count = len(normals)
    x = np.cross(normals, [0.3, 0.5, 0.8])
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    y = np.cross(normals, x)
    rows, rhs = [], []
    for i, j in mesh_edges(mesh.faces, count)[0]:
        axis = np.cross(normals[j], normals[i])
        angle = np.arctan2(np.linalg.norm(axis), normals[i] @ normals[j])
        carry = Rotation.from_rotvec(axis / np.linalg.norm(axis) * angle)
        for out in (x[i], y[i]):  # one row per component of u_i - r_ij u_j
            row = np.zeros(2 * count)
            row[[2 * i, 2 * i + 1]] = out @ x[i], out @ y[i]
            row[[2 * j, 2 * j + 1]] = -out @ carry.apply(x[j]), -out @ carry.apply(y[j])
            rows.append(row)
            rhs.append(0.0)
    area = np.zeros(count)
    np.add.at(area, mesh.faces.ravel(), np.repeat(mesh.face_areas / 3, 3))
    tilt = np.sqrt(1 - normals[:, 1] ** 2)
    level = frames.LEVEL_PULL * np.maximum(1 - 2 * tilt, 0)[:, None]
    q = np.cross(Y, normals) + level * np.cross(frames.SPARE_UP, normals)
    weight = np.sqrt(frames.FIDELITY * area / area.sum())
    for i in range(count):
        for k, out in enumerate((x[i], y[i])):
            row = np.zeros(2 * count)
            row[2 * i + k] = weight[i]
            rows.append(row)
            rhs.append(weight[i] * (q[i] @ out))
    u = np.linalg.lstsq(np.array(rows), np.array(rhs), rcond=None)[0].reshape(-1, 2)
    expected = u[:, :1] * x + u[:, 1:] * y
    expected /= np.linalg.norm(expected, axis=1, keepdims=True)
    np.testing.assert_allclose(vertex_directions(mesh, "smooth"), expected, atol=1e-5)


@pytest.mark.parametrize("kind", ["fixed", "smooth"])
def test_angle_turns_counter_clockwise_seen_from_outside(kind, rng):
    mesh = icosphere(5)
    face, barycentric = everywhere(mesh, rng)
    right, up = tangent_frames(mesh, face, barycentric, kind)
    turn = Rotation.from_rotvec(0.7 * unit_normals(mesh.face_crosses)[face])
    turned = tangent_frames(mesh, face, barycentric, kind, 0.7)
    np.testing.assert_allclose(turned[0], turn.apply(right), atol=1e-9)
    np.testing.assert_allclose(turned[1], turn.apply(up), atol=1e-9)
    quarter = tangent_frames(mesh, face, barycentric, kind, np.pi / 2)[0]
    np.testing.assert_allclose(quarter, up, atol=1e-9)


@pytest.mark.parametrize("kind", ["fixed", "smooth"])
def test_frames_turn_with_the_mesh_about_y(kind, rng):
    mesh = torus(24, 12)
    turn = Rotation.from_rotvec(0.9 * Y)
    points = everywhere(mesh, rng)
    right, _ = tangent_frames(mesh, *points, kind)
    turned, _ = tangent_frames(mesh.with_vertices(turn.apply(mesh.vertices)), *points, kind)
    # w' does not turn with the mesh: the rings at the top and bottom differ.
    close = (turned * turn.apply(right)).sum(axis=1) > np.cos(np.radians(20))
    assert close.mean() > 0.8


@pytest.mark.parametrize("kind", ["fixed", "smooth"])
def test_seams_between_copies_of_a_vertex_do_not_show(kind):
    whole = icosphere(5)
    soup = Mesh(whole.vertices[whole.faces.ravel()], np.arange(3 * len(whole.faces)).reshape(-1, 3))
    assert welded(soup.vertices).max() + 1 == len(whole.vertices)
    expected = vertex_directions(whole, kind)[whole.faces.ravel()]
    np.testing.assert_allclose(vertex_directions(soup, kind), expected, atol=1e-9)


@pytest.mark.parametrize("kind", ["fixed", "smooth"])
@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_size_does_not_matter(kind, scale, rng):
    mesh = embedded("knot")
    points = everywhere(mesh, rng)
    scaled = mesh.with_vertices(mesh.vertices * scale)
    for a, b in zip(tangent_frames(mesh, *points, kind), tangent_frames(scaled, *points, kind), strict=True):
        np.testing.assert_allclose(a, b, atol=1e-3)  # positions are float32


@pytest.mark.parametrize("kind", ["fixed", "smooth"])
def test_faces_without_an_area_and_loose_vertices_have_frames(kind):
    mesh = icosphere(3)
    vertices = np.concatenate([mesh.vertices, mesh.vertices[:1], [[9, 9, 9]]])
    extra = [[0, 0, 5], [7, 7, 7], [0, len(mesh.vertices), 5]]  # the last one's first two are at one place
    mesh = Mesh(vertices, np.concatenate([mesh.faces, extra]))
    face, barycentric = np.arange(len(mesh.faces)), np.full((len(mesh.faces), 3), 1 / 3)
    check(*tangent_frames(mesh, face, barycentric, kind), unit_normals(mesh.face_crosses)[face])
    flat = mesh.face_areas == 0
    assert flat.sum() == 3 and (unit_normals(mesh.face_crosses)[flat] == Z).all()
    point = replace(mesh, vertices=0 * mesh.vertices)
    check(*tangent_frames(point, face, barycentric, kind), np.tile(Z, (len(face), 1)))


@pytest.mark.parametrize("kind", ["fixed", "smooth"])
def test_both_sides_of_a_sheet(kind):
    """Folded onto itself: the vertex normals cancel, and nothing can be carried around its edges."""
    mesh = grid(3, 3)
    both = Mesh(mesh.vertices, np.concatenate([mesh.faces, mesh.faces[:, ::-1]]))
    face, barycentric = np.arange(len(both.faces)), np.full((len(both.faces), 3), 1 / 3)
    check(*tangent_frames(both, face, barycentric, kind), unit_normals(both.face_crosses)[face])


def test_directions_that_cancel_leave_a_frame():
    mesh = Mesh(np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0]]), np.array([[0, 1, 2]]))
    field = np.array([[1, 0, 0], [-1, 0, 0], [0, 1, 0]])
    right, up = tangent_frames(mesh, np.array([0]), np.array([[0.5, 0.5, 0.0]]), field=field)
    check(right, up, Z[None])


@pytest.mark.parametrize("length", [1e-30, 1.0, 1e30])
def test_a_field_says_where_up_points(length, rng):
    mesh = icosphere(6)
    field = length * (np.cross(X, mesh.vertices) + 0.4 * mesh.vertices)
    face, barycentric = everywhere(mesh, rng)
    right, up = tangent_frames(mesh, face, barycentric, field=field)
    check(right, up, unit_normals(mesh.face_crosses)[face])
    points = np.einsum("mk,mkc->mc", barycentric, mesh.vertices[mesh.faces[face]])
    around = np.cross(X, points)
    fine = np.linalg.norm(around, axis=1) > 0.3  # away from the poles, where it turns
    cosine = (up * around).sum(axis=1) / np.linalg.norm(around, axis=1)
    assert cosine[fine].min() > 0.98


def test_a_field_without_a_direction_falls_back_to_fixed():
    mesh = icosphere(4)
    field = np.tile(X, (len(mesh.vertices), 1))
    field[::3] = 0.0
    field[1::3] = mesh.normals[1::3]
    directions, fixed = vertex_directions(mesh, "smooth", field), vertex_directions(mesh, "fixed")
    np.testing.assert_allclose(directions[::3], fixed[::3], atol=1e-12)
    np.testing.assert_allclose(directions[1::3], fixed[1::3], atol=1e-12)
    assert np.abs(directions[2::3] - fixed[2::3]).max() > 0.5


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kind": "random"}, "fixed, smooth"),
        ({"field": np.full((12, 3), np.nan)}, "NaN"),
        ({"field": np.full((12, 3), np.inf)}, "NaN"),
        ({"field": np.ones((11, 3))}, "shape"),
    ],
)
def test_what_makes_no_sense_is_refused(options, message):
    with pytest.raises(ConfigError, match=message):
        vertex_directions(icosphere(1), **options)
