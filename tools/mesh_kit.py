"""Signed distances, and meshes of their zero sets, for `make_meshes.py`."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.spatial import KDTree

from mitex.mesh import Mesh, remesh
from mitex.mesh.topology import boundary_edges, non_manifold_edges

Field = Callable[[np.ndarray], np.ndarray]  # (N, 3) points -> (N,) distance, negative inside


def smooth_union(a: np.ndarray, b: np.ndarray, radius: float) -> np.ndarray:
    """Union of two distances whose crease is rounded by a cubic of about `radius`."""
    h = np.maximum(radius - np.abs(a - b), 0.0) / radius
    return np.minimum(a, b) - h**3 * radius / 6.0


def smooth_cut(a: np.ndarray, b: np.ndarray, radius: float) -> np.ndarray:
    """a without b."""
    return -smooth_union(-a, b, radius)


def ellipsoid(p: np.ndarray, centre: tuple, radii: tuple) -> np.ndarray:
    """First-order distance to an axis-aligned ellipsoid."""
    q = (p - centre) / radii
    length = np.linalg.norm(q, axis=1)
    slope = np.linalg.norm(q / radii, axis=1)
    return length * (length - 1.0) / np.maximum(slope, 1e-9)


def cone(
    p: np.ndarray, a: np.ndarray, b: np.ndarray, radius_a: np.ndarray | float, radius_b: np.ndarray | float
) -> np.ndarray:
    """A capsule whose radius goes from `radius_a` at a to `radius_b` at b; one for all points or one each."""
    axis = b - a
    t = np.clip(((p - a) * axis).sum(axis=-1) / (axis**2).sum(axis=-1), 0.0, 1.0)
    return np.linalg.norm(p - a - t[:, None] * axis, axis=1) - (radius_a + (radius_b - radius_a) * t)


def tube(path: np.ndarray, radii: np.ndarray, closed: bool = False) -> Field:
    """Cones along a path (n, 3) of radii (n,): the two beside the nearest point of the path."""
    tree, last = KDTree(path), len(path) - 1

    def field(p: np.ndarray) -> np.ndarray:
        k: np.ndarray = np.atleast_1d(tree.query(p)[1])
        before, after = ((k - 1) % (last + 1), (k + 1) % (last + 1))
        if not closed:
            before, after = np.where(k == 0, 1, before), np.where(k == last, last - 1, after)
        ends = [cone(p, path[k], path[j], radii[k], radii[j]) for j in (before, after)]
        return np.minimum(*ends)

    return field


def disc(p: np.ndarray, centre: tuple, radius: float, half_height: float, rounding: float) -> np.ndarray:
    """An upright cylinder with rounded edges."""
    q = p - centre
    across = np.hypot(q[:, 0], q[:, 2]) - radius + rounding
    up = np.abs(q[:, 1]) - half_height + rounding
    outside = np.hypot(np.maximum(across, 0.0), np.maximum(up, 0.0))
    return outside + np.minimum(np.maximum(across, up), 0.0) - rounding


def trace(field: Field, low: tuple[float, ...], high: tuple[float, ...], cells: int) -> Mesh:
    """The zero set by marching tetrahedra, six to a grid cell: a closed manifold, of slivers too."""
    step = max(h - lo for h, lo in zip(high, low, strict=True)) / cells
    axes = [np.arange(lo, h + step, step) for lo, h in zip(low, high, strict=True)]
    points = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1)
    values = _sampled(field, points, step).ravel()
    shape, points = points.shape[:3], points.reshape(-1, 3)
    cells_of = np.indices([n - 1 for n in shape]).reshape(3, -1)
    corners = np.asarray(np.ravel_multi_index(tuple(cells_of), shape))
    offsets = np.array([np.ravel_multi_index(o, shape) for o in np.ndindex(2, 2, 2)])
    inside = values[corners[:, None] + offsets] < 0.0
    cubes = corners[inside.any(axis=1) & ~inside.all(axis=1), None] + offsets
    # Paths from corner 0 to corner 7 (bits x, y, z), every other one mirrored, so that all wind alike.
    tetrahedra = [(0, 4, 6, 7), (0, 6, 2, 7), (0, 2, 3, 7), (0, 3, 1, 7), (0, 1, 5, 7), (0, 5, 4, 7)]
    sides = np.concatenate([_cut_tetrahedra(cubes[:, list(t)], values) for t in tetrahedra])  # (T, 3, 2)
    keys, faces = np.unique(np.sort(sides, axis=2).reshape(-1, 2), axis=0, return_inverse=True)
    f0, f1 = values[keys[:, 0]], values[keys[:, 1]]
    share = np.clip(f0 / (f0 - f1), 0.02, 0.98)[:, None]
    return Mesh(points[keys[:, 0]] * (1.0 - share) + points[keys[:, 1]] * share, faces.reshape(-1, 3))


def _cut_tetrahedra(corners: np.ndarray, values: np.ndarray) -> np.ndarray:
    """(N, 4) grid points -> (T, 3, 2) triangles between edges (pairs of grid points), facing outwards."""
    inside = values[corners] < 0.0
    pieces = []
    for code in range(1, 15):
        which = corners[(inside * [1, 2, 4, 8]).sum(axis=1) == code]
        low = [k for k in range(4) if code >> k & 1]
        high = [k for k in range(4) if k not in low]
        # An odd order of the corners turns the triangle around.
        even = np.linalg.det(np.eye(4)[low + high]) > 0.0
        if len(low) == 2:
            quad = [(low[0], high[0]), (low[0], high[1]), (low[1], high[1]), (low[1], high[0])]
            triangles = [quad[:3], [quad[0], *quad[2:]]]
        elif len(low) == 1:
            triangles = [[(low[0], h) for h in high]]
        else:
            triangles = [[(k, high[0]) for k in low]]
        pieces += [which[:, np.array(t if even else t[::-1])] for t in triangles]
    return np.concatenate(pieces)


def _sampled(field: Field, points: np.ndarray, step: float, stride: int = 6) -> np.ndarray:
    """Values on a grid (a, b, c, 3), exact near the zero set and coarse elsewhere."""
    shape = points.shape[:3]
    middle = [np.minimum(np.arange(n) // stride * stride + stride // 2, n - 1) for n in shape]
    block = points[np.ix_(*(m[::stride] for m in middle))]
    coarse = _in_parts(field, block.reshape(-1, 3)).reshape(block.shape[:3])
    values = coarse[np.ix_(*(np.arange(n) // stride for n in shape))]
    near = np.abs(values) < 1.5 * stride * step
    values[near] = _in_parts(field, points[near])
    if any(np.take(values, side, axis).min() < 0.0 for axis in range(3) for side in (0, -1)):
        raise ValueError("the shape leaves its box")
    return values


def _in_parts(field: Field, points: np.ndarray) -> np.ndarray:
    return np.concatenate([field(part) for part in np.array_split(points, max(1, len(points) // 50_000))])


def onto(points: np.ndarray, field: Field, rounds: int = 4) -> np.ndarray:
    """Newton steps along the gradient to the zero set."""
    for _ in range(rounds):
        gradient = _gradient(points, field)
        slope = np.maximum((gradient**2).sum(axis=1), 0.04)
        move = (field(points) / slope)[:, None] * gradient
        points = points - np.clip(move, -0.05, 0.05)
    return points


def _gradient(points: np.ndarray, field: Field, step: float = 1e-4) -> np.ndarray:
    offsets = step * np.eye(3)
    return np.stack([field(points + o) - field(points - o) for o in offsets], axis=1) / (2.0 * step)


def relax(mesh: Mesh, field: Field | None, rounds: int) -> Mesh:
    """Moves vertices along the surface towards the middle of their neighbours; boundaries stay."""
    points = mesh.vertices.astype(np.float64)
    graph = mesh.edges
    free = np.ones(len(points), bool)
    free[boundary_edges(mesh.faces, len(points)).ravel()] = False
    for _ in range(rounds):
        middle = np.add.reduceat(points[graph.indices], graph.indptr[:-1]) / graph.valence[:, None]
        move = 0.5 * (middle - points)
        normals = mesh.with_vertices(points).normals.astype(np.float64)
        move -= (move * normals).sum(axis=1, keepdims=True) * normals
        points[free] += move[free]
        if field is not None:
            points = onto(points, field, 1)
    if field is not None:
        points = onto(points, field)
    return mesh.with_vertices(points)


def solid(
    name: str, field: Field, box: tuple[tuple[float, ...], tuple[float, ...]], vertices: int, cells: int = 110
) -> Mesh:
    """A closed mesh of a zero set within `box` = (low, high)."""
    dense = trace(field, box[0], box[1], cells)
    coarse = remesh(relax(dense, field, 3), vertices, feature_angle=180.0)
    for stage in (dense, coarse):
        if len(non_manifold_edges(stage.faces, len(stage.vertices))):
            raise ValueError(f"{name} has parts that are too thin or too close")
    mesh = relax(coarse, field, 30)
    return Mesh(mesh.vertices, mesh.faces, name=name)
