"""Geometry for `make_captures.py`: a closed base, elements scattered over it, and meshes of many of them."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import across, unit
from mitex.mesh import Mesh, icosphere


@dataclass(frozen=True, eq=False)
class Part:
    """A mesh with what its surface is like.

    Attributes:
        mesh: shaded with smooth normals; elements that share no vertices keep their creases.
        colours: (V, 3) linear base colours in [0, 1].
        roughness: (V,) in (0, 1].
    """

    mesh: Mesh
    colours: np.ndarray
    roughness: np.ndarray


@dataclass(frozen=True, eq=False)
class Base:
    """A star-shaped closed surface around the origin.

    Attributes:
        radius: unit directions (N, 3) -> distance of the surface from the origin (N,).
    """

    radius: Callable[[np.ndarray], np.ndarray]

    def onto(self, points: np.ndarray) -> np.ndarray:
        """Points (..., 3) moved along the line from the origin onto the surface."""
        directions = unit(points.reshape(-1, 3))
        return (directions * self.radius(directions)[:, None]).reshape(points.shape)

    def normals(self, points: np.ndarray, step: float = 1e-4) -> np.ndarray:
        """Outward unit normals at points (..., 3) of the surface, by central differences."""
        flat = points.reshape(-1, 3)
        slopes = [self._level(flat + axis) - self._level(flat - axis) for axis in step * np.eye(3)]
        return unit(np.stack(slopes, axis=1)).reshape(points.shape)

    def _level(self, points: np.ndarray) -> np.ndarray:
        length = np.linalg.norm(points, axis=1)
        return length / self.radius(points / length[:, None])

    def mesh(self, frequency: int = 48) -> Mesh:
        """The surface as a mesh of even triangles."""
        return Mesh(self.onto(icosphere(frequency).vertices.astype(np.float64)), icosphere(frequency).faces)

    def spread(self, rng: np.random.Generator, spacing: float, rounds: int = 6) -> np.ndarray:
        """Points (N, 3) about `spacing` apart, made even by `rounds` of Lloyd's iteration."""
        mesh = self.mesh(64)
        area = float(mesh.face_areas.sum(dtype=np.float64))
        count = max(int(area / (0.866 * spacing**2)), 12)
        points, samples = self.scatter(rng, count), self.scatter(rng, 80 * count)
        for _ in range(rounds):
            owner = np.asarray(KDTree(points).query(samples)[1])
            total = np.stack([np.bincount(owner, samples[:, k], count) for k in range(3)], axis=1)
            points = self.onto(total / np.maximum(np.bincount(owner, minlength=count), 1)[:, None])
        return points

    def scatter(self, rng: np.random.Generator, count: int) -> np.ndarray:
        """Points (count, 3), uniform by area."""
        mesh = self.mesh(64)
        face = rng.choice(len(mesh.faces), count, p=mesh.face_areas / mesh.face_areas.sum())
        root, share = np.sqrt(rng.random(count)), rng.random(count)
        weights = np.stack([1 - root, root * (1 - share), root * share], axis=1)
        return self.onto(interpolate(weights, mesh.vertices[mesh.faces[face]]))

    def frames(self, points: np.ndarray, along: np.ndarray | None = None) -> np.ndarray:
        """(N, 3, 3) rows tangent, bitangent, normal at points (N, 3).

        Args:
            points: of the surface.
            along: (N, 3) or (3,), what the tangents follow; +z if left out.
        """
        normal = self.normals(points)
        along = np.broadcast_to((0.0, 0.0, 1.0) if along is None else along, points.shape)
        tangent = across(along, normal)
        # Where `along` is the normal any tangent will do.
        spare = np.cross(normal, np.eye(3)[np.abs(normal).argmin(axis=1)])
        tangent = unit(np.where(np.linalg.norm(tangent, axis=1, keepdims=True) > 1e-3, tangent, spare))
        return np.stack([tangent, np.cross(normal, tangent), normal], axis=1)

    def lift(self, points: np.ndarray, frames: np.ndarray, local: np.ndarray) -> np.ndarray:
        """Elements bent over the surface: local x, y along it and z off it, (N, ..., 3) -> (N, ..., 3)."""
        shape = (len(points), *(1,) * (local.ndim - 2), 3)
        tangent, bitangent, _ = (frames[:, k].reshape(shape) for k in range(3))
        foot = self.onto(points.reshape(shape) + local[..., :1] * tangent + local[..., 1:2] * bitangent)
        return foot + local[..., 2:] * self.normals(foot)


def cells(points: np.ndarray, frames: np.ndarray, angles: np.ndarray, softness: float) -> np.ndarray:
    """How far the Voronoi cell of each point reaches in its tangent plane.

    Args:
        points: (N, 3) on the surface.
        frames: (N, 3, 3) rows tangent, bitangent, normal.
        angles: (A,) [rad] in the tangent plane.
        softness: rounds the corners, relative to the reach.

    Returns:
        (N, A) distances from the point to its cell's border.
    """
    near = np.asarray(KDTree(points).query(points, k=14)[1])[:, 1:]
    offset = np.einsum("nkd,njd->nkj", points[near] - points[:, None], frames[:, :2])
    half = 0.5 * np.linalg.norm(offset, axis=2, keepdims=True)
    cosine = (offset / (2.0 * half)) @ np.stack([np.cos(angles), np.sin(angles)])
    reach = half / np.maximum(cosine, 1e-3)
    nearest = reach.min(axis=1, keepdims=True)
    # A soft minimum.
    crowding = np.exp(-(reach / nearest - 1.0) / softness).sum(axis=1)
    return nearest[:, 0] * (1.0 - softness * np.log(crowding))


def lattice(rows: int, columns: int, closed: bool) -> np.ndarray:
    """Faces of a grid of vertices, row by row; `closed` joins the last column to the first. (F, 3)."""
    row, column = np.meshgrid(
        np.arange(rows - 1), np.arange(columns if closed else columns - 1), indexing="ij"
    )
    a, b = row * columns + column, row * columns + (column + 1) % columns
    c, d = a + columns, b + columns
    return np.stack([a, b, d, a, d, c], axis=-1).reshape(-1, 3)


def repeated(vertices: np.ndarray, faces: np.ndarray) -> Mesh:
    """One mesh of N elements with vertices (N, K, 3) and the same faces (F, 3) of indices below K."""
    count, size = vertices.shape[:2]
    all_faces = faces[None] + size * np.arange(count)[:, None, None]
    mesh = Mesh(vertices.reshape(-1, 3), all_faces.reshape(-1, 3))
    # At the tip of an element a ring of vertices is one point: Mitsuba makes NaN of triangles without area.
    return Mesh(mesh.vertices, mesh.faces[mesh.face_areas > 1e-12])


def ribbon(
    path: np.ndarray, normals: np.ndarray, half: float, thickness: float, closed: bool, sides: int = 16
) -> tuple[np.ndarray, np.ndarray]:
    """A flat tube with rounded edges along a path.

    Args:
        path: (N, 3).
        normals: (N, 3) which way its flat side faces, about.
        half: of the width.
        thickness: half of it.
        closed: the path's end joins its start.
        sides: vertices around, K.

    Returns:
        (N, K, 3) vertices, counter-clockwise around the path, and (N, K) how far across the width.
    """
    ahead = np.roll(path, -1, axis=0) - np.roll(path, 1, axis=0)
    if not closed:
        ahead[0], ahead[-1] = path[1] - path[0], path[-1] - path[-2]
    ahead = unit(ahead)
    across = unit(np.cross(normals, ahead))
    angle = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    x, y = (np.sign(c) * np.abs(c) ** 0.7 for c in (np.cos(angle), np.sin(angle)))
    offset = half * x[:, None] * across[:, None] + thickness * y[:, None] * np.cross(ahead, across)[:, None]
    return path[:, None] + offset, np.broadcast_to(half * x, offset.shape[:2])


def noise(rng: np.random.Generator, points: np.ndarray, size: float, waves: int = 40) -> np.ndarray:
    """Smooth Gaussian noise of unit variance at points (..., D), with features of about `size`."""
    vectors = rng.normal(size=(points.shape[-1], waves)) * (2.0 / size)
    phases = rng.uniform(0.0, 2.0 * np.pi, waves).astype(np.float32)
    return np.cos(points.astype(np.float32) @ vectors.astype(np.float32) + phases).sum(-1) * np.sqrt(
        2.0 / waves
    )


def ball(count: int, rng: np.random.Generator) -> np.ndarray:
    """`count` unit directions, even over the sphere (a Fibonacci lattice, turned at random), (count, 3)."""
    k = np.arange(count) + 0.5
    z, angle = 1.0 - 2.0 * k / count, np.pi * (3.0 - np.sqrt(5.0)) * k
    ring = np.sqrt(1.0 - z * z)
    turn, triangular = np.linalg.qr(rng.normal(size=(3, 3)))
    return np.stack([ring * np.cos(angle), ring * np.sin(angle), z], axis=1) @ (
        turn * np.sign(np.diag(triangular))
    )


def joined(parts: Sequence[Part]) -> Part:
    """All parts as one."""
    starts = np.cumsum([0, *(len(part.mesh.vertices) for part in parts)])
    faces = np.concatenate([part.mesh.faces + start for part, start in zip(parts, starts[:-1], strict=True)])
    return Part(
        Mesh(np.concatenate([part.mesh.vertices for part in parts]), faces),
        np.concatenate([part.colours for part in parts]),
        np.concatenate([part.roughness for part in parts]),
    )
