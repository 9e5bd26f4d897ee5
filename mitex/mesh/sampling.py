"""Random points on the surface of a mesh, and such as keep their distance (Poisson disks)."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from mitex.errors import MeshError
from mitex.mesh.mesh import Mesh

DENSITY = 30  # random points for each one of a Poisson-disk set
FILL = 0.6  # points of such a set times squared distance over area; 0.70 when no further one fits


def disk_count(area: float, distance: float) -> float:
    """How many points that are a distance apart fill an area, nearly."""
    return FILL * area / distance**2


def disk_distance(area: float, count: int) -> float:
    """How far apart points are when so many fill an area, nearly."""
    return float(np.sqrt(FILL * area / count))


def random_points(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Points all over a surface, each place as likely as any other.

    Returns:
        (N,) the faces that they lie on, and (N, 3) float64 barycentric coordinates there.

    Raises:
        MeshError: the mesh has no area.
    """
    areas = mesh.face_areas.astype(np.float64)
    if not areas.sum() > 0:
        raise MeshError(f"{mesh.name} has no area to place anything on", "give a surface")
    faces = rng.choice(len(areas), count, p=areas / areas.sum())
    root, share = np.sqrt(rng.random((count, 1))), rng.random((count, 1))
    return faces, np.concatenate([1 - root, root * (1 - share), root * share], 1)


def apart(
    points: np.ndarray, distance: float, normals: np.ndarray | None = None, most: int | None = None
) -> np.ndarray:
    """The points of a Poisson-disk set, by throwing darts: each is the first that no earlier one is near to.

    Args:
        points: (N, 3) candidates, in the order in which they are thrown.
        distance: that they keep [units of the points].
        normals: (N, 3); with them, points whose normals do not agree may be near, as on both sides of a thin
            part.
        most: stop at so many; None for all.

    Returns:
        (K,) indices of the points, ascending.
    """
    tree, free, indices = KDTree(points), np.ones(len(points), bool), []
    for index in range(len(points)):
        if len(indices) == most:
            break
        if free[index]:
            indices.append(index)
            near = np.array(tree.query_ball_point(points[index], distance))
            free[near if normals is None else near[normals[near] @ normals[index] > 0]] = False
    return np.array(indices, np.int64)
