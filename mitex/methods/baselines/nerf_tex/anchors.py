"""Anchors: where on a mesh boxes stand, and how they are turned (Baatz et al. 2022)."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import orthonormal, unit
from mitex.mesh import Mesh
from mitex.mesh.sampling import DENSITY, apart, disk_count, random_points

MOST = 50_000  # anchors


@dataclass(frozen=True, eq=False)
class Anchors:
    """N places on a mesh.

    Attributes:
        points: (N, 3) float32.
        frames: (N, 3, 3) float32, rows x, y and z of what stands there, right-handed.
    """

    points: np.ndarray
    frames: np.ndarray

    def __len__(self) -> int:
        return len(self.points)


def place_anchors(mesh: Mesh, distance: float, tilt: float, aligned: bool, seed: int) -> Anchors:
    """Anchors all over a mesh, by throwing darts.

    Those whose normals agree are at least `distance` apart, so that both sides of a thin part get theirs; and
    nearly every place has one within that distance.

    Args:
        mesh: the target.
        distance: between anchors [mesh units].
        tilt: standard deviation by which the z axes lean from the normals, in both directions [rad].
        aligned: the x axes point along the mesh's first axis as far as they can, else anywhere.
        seed: of all choices.

    Raises:
        MeshError: the mesh has no area.
        ConfigError: there would be more than 50,000 anchors.
    """
    count = disk_count(mesh.face_areas.sum(dtype=np.float64), distance)
    if count > MOST:
        raise ConfigError(f"{count:.0f} boxes on {mesh.name}", "use a larger scale or spacing")
    rng = np.random.default_rng(seed)
    faces, weights = random_points(mesh, DENSITY * (int(count) + 1), rng)
    points = interpolate(weights, mesh.vertices[mesh.faces[faces]])
    normals = unit(interpolate(weights, mesh.normals[mesh.faces[faces]]))
    selection = apart(points, distance, mesh.face_normals[faces])
    return Anchors(points[selection].astype(np.float32), _frames(normals[selection], tilt, aligned, rng))


def _frames(normals: np.ndarray, tilt: float, aligned: bool, rng: np.random.Generator) -> np.ndarray:
    first = np.broadcast_to(np.array([1, 0, 0], np.float32), normals.shape)
    x = orthonormal(first, normals)
    lean = rng.normal(0.0, tilt, (len(normals), 2)) if tilt else np.zeros((len(normals), 2))
    z = unit(normals + lean[:, :1] * x + lean[:, 1:] * np.cross(normals, x))
    x = orthonormal(first, z)
    angle = np.zeros((len(normals), 1)) if aligned else rng.uniform(0, 2 * np.pi, (len(normals), 1))
    x = np.cos(angle) * x + np.sin(angle) * np.cross(z, x)
    return np.stack([x, np.cross(z, x), z], 1).astype(np.float32)
