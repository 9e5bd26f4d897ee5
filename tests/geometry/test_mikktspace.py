"""MikkTSpace tangents against the WebAssembly build of a public implementation, and by hand."""

from collections.abc import Callable
from functools import cache

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mitex.atlas import PADDING, unwrap
from mitex.charts import Packing
from mitex.flat_charts import projected_charts
from mitex.geometry.mikktspace import DEFAULT, corner_tangents
from mitex.mesh import Mesh, embedded, grid, icosphere, torus
from tests.geometry.reference import mikktspace


@cache
def unwrapped(name: str) -> tuple[Mesh, np.ndarray]:
    """Charts of a large mesh, of which those that are flattened take seconds."""
    mesh = embedded(name)
    if name == "knot":
        return mesh, unwrap(Mesh(mesh.vertices, mesh.faces), 512, PADDING)
    return mesh, projected_charts(mesh, Packing(512, PADDING))[0]


def planar(mesh: Mesh) -> np.ndarray:
    """UVs by projection along z: mirrored on the far side, thin and empty at the outline."""
    return mesh.vertices[mesh.faces][..., :2].copy()


def mirrored() -> tuple[Mesh, np.ndarray]:
    """The UVs of one half, folded over the other: both share vertices and UVs at the fold."""
    mesh = grid(12, 12)
    vertices = mesh.vertices.astype(np.float64)
    vertices[:, 2] = 0.2 * np.sin(5 * vertices[:, 0]) * np.cos(3 * vertices[:, 1])
    mesh = mesh.with_vertices(vertices)
    uv = mesh.vertices[mesh.faces][..., :2].copy()
    middle = (mesh.vertices[:, 0].max() + mesh.vertices[:, 0].min()) / 2
    uv[..., 0] = np.abs(uv[..., 0] - middle)
    return mesh, uv


def cube(divisions: int = 3) -> tuple[Mesh, np.ndarray]:
    """Hard edges: vertices are there once for each side; each side shows the whole square."""
    side = grid(divisions, divisions)
    low, high = side.vertices.min(axis=0), side.vertices.max(axis=0)
    square = (side.vertices - low)[:, :2] / (high - low)[:2]
    vertices, faces, uv = [], [], []
    for k in range(6):
        a, b, c = np.roll(np.eye(3), k, axis=0)
        turn = 1 if k < 3 else -1
        points = turn * c + (2 * square[:, :1] - 1) * a * turn + (2 * square[:, 1:] - 1) * b
        vertices.append(points)
        faces.append(side.faces + k * len(square))
        uv.append(square[side.faces])
    return Mesh(np.concatenate(vertices), np.concatenate(faces)), np.concatenate(uv).astype(np.float32)


def flattened() -> tuple[Mesh, np.ndarray]:
    """A third of the triangles has no UV area: in a point, or on a line."""
    mesh, uv = unwrapped("knot")
    uv, rng = uv.copy(), np.random.default_rng(4)
    empty = rng.permutation(len(uv))[: len(uv) // 3]
    half = len(empty) // 2
    uv[empty[:half]] = uv[empty[:half], :1]
    uv[empty[half:], 2] = uv[empty[half:], 1]
    return mesh, uv


def collapsed() -> tuple[Mesh, np.ndarray]:
    """Some triangles have corners in one place."""
    mesh, uv = unwrapped("vase")
    vertices = mesh.vertices.copy()
    for face in mesh.faces[::40]:
        vertices[face[1]] = vertices[face[0]]
    return mesh.with_vertices(vertices), uv


def non_manifold() -> tuple[Mesh, np.ndarray]:
    """Five leaves of a book, in no order, some turned over."""
    angle = np.array([0.3, 2.0, 1.1, 4.0, 5.5])
    tips = np.stack([np.cos(angle), np.sin(angle), np.full(5, 0.4)], axis=1)
    vertices = np.concatenate([[[0, 0, 0], [0, 0, 1]], tips])
    faces = np.array([[0, 1, 2], [0, 1, 3], [1, 0, 4], [1, 0, 5], [0, 1, 6]])
    uv = vertices[faces] @ np.array([[0.5, 0.1], [0.3, -0.4], [0.2, 1.0]])
    return Mesh(vertices, faces), uv.astype(np.float32)


def wrapped(mesh: Mesh) -> tuple[Mesh, np.ndarray]:
    """UVs by angle and height, stretched and with a seam of mirrored, wide triangles."""
    turn = Rotation.from_rotvec([0.3, 0.8, -0.4]).as_matrix()  # else some are opposite to the last bit
    p = mesh.vertices[mesh.faces] @ turn
    return mesh, np.stack([np.arctan2(p[..., 1], p[..., 0]), p[..., 2]], axis=2).astype(np.float32)


def noise() -> tuple[Mesh, np.ndarray]:
    """Random UVs, not all different: triangles of any orientation, and without area, share edges."""
    mesh, rng = icosphere(6), np.random.default_rng(2)
    uv = rng.random((len(mesh.vertices), 2), np.float32)
    for a, b, _ in mesh.faces[::7]:
        uv[a] = uv[b]
    return mesh, uv[mesh.faces]


EXAMPLES: dict[str, Callable[[], tuple[Mesh, np.ndarray]]] = {
    **{name: lambda name=name: unwrapped(name) for name in ("shaderball", "knot", "vase", "mushrooms")},
    "planar sphere": lambda: (icosphere(8), planar(icosphere(8))),
    "planar torus": lambda: (torus(24, 12), planar(torus(24, 12))),
    "wrapped sphere": lambda: wrapped(icosphere(5)),
    "mirrored": mirrored,
    "cube": cube,
    "flattened": flattened,
    "collapsed": collapsed,
    "non-manifold": non_manifold,
    "noise": noise,
    "no UVs": lambda: (icosphere(2), np.zeros((len(icosphere(2).faces), 3, 2), np.float32)),
}


@pytest.mark.parametrize("name", EXAMPLES)
def test_the_reference_agrees(name, tmp_path):
    mesh, uv = EXAMPLES[name]()
    corners = mesh.vertices[mesh.faces], mesh.normals[mesh.faces], uv
    vectors, signs = mikktspace(*corners, tmp_path)
    ours = corner_tangents(mesh.vertices, mesh.normals, mesh.faces, uv)
    cosine = (vectors * ours.vectors).sum(axis=2).clip(-1, 1)
    np.testing.assert_array_equal(ours.signs, signs)
    assert np.degrees(np.arccos(np.quantile(cosine, 0.001))) < 0.5


def test_angles_weigh_by_hand():
    """Around the origin: 90 degrees with dp/du along x, and 45 degrees with dp/du = (1, -1/2)."""
    vertices = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [-1, 1, 0]], np.float32)
    normals = np.tile(np.array([0, 0, 1], np.float32), (4, 1))
    faces = np.array([[0, 1, 2], [2, 3, 0]])
    uv = np.array([[0, 0], [1, 0], [0, 1], [-1, 0.5]], np.float32)[faces]
    vectors, signs, fans = corner_tangents(vertices, normals, faces, uv)
    x, slope = np.array([1.0, 0, 0]), np.array([2.0, -1, 0]) / 5**0.5
    for corner, other, angles in (((0, 0), (1, 2), (90, 45)), ((0, 2), (1, 0), (45, 90))):
        expected = angles[0] * x + angles[1] * slope
        np.testing.assert_allclose(vectors[corner], expected / np.linalg.norm(expected), atol=1e-12)
        np.testing.assert_array_equal(vectors[corner], vectors[other])
        assert fans[corner] == fans[other]
    np.testing.assert_allclose(vectors[0, 1], x, atol=1e-12)
    np.testing.assert_allclose(vectors[1, 1], slope, atol=1e-12)
    assert (signs == 1).all() and len(np.unique(fans)) == 4


@pytest.mark.parametrize("name", ["planar torus", "cube", "mirrored"])
def test_order_and_indices_do_not_matter(name, rng):
    """Faces in another order, corners counted from another one, each face with vertices of its own."""
    mesh, uv = EXAMPLES[name]()
    expected = corner_tangents(mesh.vertices, mesh.normals, mesh.faces, uv)
    order, turn = rng.permutation(len(mesh.faces)), rng.integers(0, 3, len(mesh.faces))
    at = order[:, None], ((turn[:, None] + np.arange(3)) % 3)[order]
    faces, uv = mesh.faces[at], uv[at]
    own = np.arange(3 * len(faces)).reshape(-1, 3)
    vertices, normals = (a[faces].reshape(-1, 3) for a in (mesh.vertices, mesh.normals))
    vectors, signs, _ = corner_tangents(vertices, normals, own, uv)
    np.testing.assert_allclose(vectors, expected.vectors[at], atol=1e-9)
    np.testing.assert_array_equal(signs, expected.signs[at])


def test_turning_the_mesh_turns_the_tangents():
    mesh, uv = EXAMPLES["wrapped sphere"]()
    turn = Rotation.from_rotvec([1.0, -0.4, 0.7]).as_matrix()
    before = corner_tangents(mesh.vertices, mesh.normals, mesh.faces, uv)
    vertices, normals = ((a @ turn.T).astype(np.float32) for a in (1e-3 * mesh.vertices, mesh.normals))
    after = corner_tangents(vertices, normals, mesh.faces, uv)
    np.testing.assert_allclose(after.vectors, before.vectors @ turn.T, atol=1e-4)
    np.testing.assert_array_equal(after.signs, before.signs)


def test_without_uv_area_there_is_a_default():
    mesh, uv = EXAMPLES["no UVs"]()
    vectors, signs, _ = corner_tangents(mesh.vertices, mesh.normals, mesh.faces, uv)
    assert (vectors == DEFAULT).all() and (signs == -1).all()
