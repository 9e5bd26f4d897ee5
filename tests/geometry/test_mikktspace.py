"""MikkTSpace tangents against the WebAssembly build of a public implementation, and by hand."""

from collections.abc import Callable

import numpy as np
import pytest

from mitex.atlas import Atlas
from mitex.geometry.mikktspace import DEFAULT, corner_tangents
from mitex.mesh import Mesh, embedded, grid, icosphere, torus
from tests.node import run_node

GENERATE = """
const { generateTangents } = require('mikktspace'), fs = require('fs');
const [input, output, count] = process.argv.slice(1);
const bytes = fs.readFileSync(input), all = new Float32Array(bytes.buffer, bytes.byteOffset, 8 * count);
const [p, n, t] = [all.slice(0, 3 * count), all.slice(3 * count, 6 * count), all.slice(6 * count)];
fs.writeFileSync(output, Buffer.from(generateTangents(p, n, t).buffer));
"""


def reference(mesh: Mesh, normals: np.ndarray, uv: np.ndarray, folder) -> tuple[np.ndarray, np.ndarray]:
    """(F, 3, 3) tangents and (F, 3) signs, by the reference."""
    arrays = (mesh.vertices[mesh.faces], normals[mesh.faces], uv)
    values = np.concatenate([a.astype("<f4").ravel() for a in arrays])
    (folder / "in").write_bytes(values.tobytes())
    run_node("mikktspace", GENERATE, folder / "in", folder / "out", 3 * len(mesh.faces))
    tangents = np.frombuffer((folder / "out").read_bytes(), "<f4").reshape(-1, 3, 4)
    return tangents[..., :3].astype(np.float64), tangents[..., 3]


def unwrapped(name: str) -> tuple[Mesh, np.ndarray]:
    mesh = embedded(name)
    return mesh, Atlas.build(Mesh(mesh.vertices, mesh.faces), 512).uv


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
    p = mesh.vertices[mesh.faces]
    return mesh, np.stack([np.arctan2(p[..., 1], p[..., 0]), p[..., 2]], axis=2).astype(np.float32)


def noise() -> tuple[Mesh, np.ndarray]:
    """Random UVs on a coarse grid: many triangles of either orientation share edges with equal UVs."""
    mesh, rng = icosphere(6), np.random.default_rng(2)
    return mesh, rng.integers(0, 3, (len(mesh.vertices), 2))[mesh.faces].astype(np.float32)


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
    vectors, signs = reference(mesh, mesh.normals, uv, tmp_path)
    ours = corner_tangents(mesh.vertices, mesh.normals, mesh.faces, uv)
    cosine = (vectors * ours.vectors).sum(axis=2).clip(-1, 1)
    angle = np.degrees(np.arccos(cosine))
    print(name, len(mesh.faces), 'q99.9', np.quantile(angle, 0.999), 'max', angle.max(), (angle>0.5).sum(), 'signs', (signs != ours.signs).sum())
    np.testing.assert_array_equal(ours.signs, signs)
    assert np.quantile(angle, 0.999) < 0.5
