"""How alike two surfaces are in their details: distributions of what is measured at edges and vertices."""

from __future__ import annotations

import numpy as np
import scipy.stats

from mitex.geometry.vectors import scatter_add, unit
from mitex.mesh import Mesh
from mitex.mesh.cotangents import cotangent_weights, vertex_areas
from mitex.mesh.topology import mesh_edges, paired_sides

LEAST = 1e-12


def local_statistics(mesh: Mesh) -> dict[str, np.ndarray]:
    """Measures of a surface that no rigid motion or scaling changes.

    Returns:
        `dihedral`: signed angles between neighbouring faces, positive where the surface is convex [rad];
        `edges`: edge lengths over their mean; `curvature`: signed mean curvature at the vertices times the
        mean edge length, positive where the surface is convex.
    """
    pairs, _ = mesh_edges(mesh.faces, len(mesh.vertices))
    points = mesh.vertices.astype(np.float64)
    lengths = np.linalg.norm(points[pairs[:, 0]] - points[pairs[:, 1]], axis=1)
    return {
        "dihedral": _dihedral_angles(mesh),
        "edges": lengths / lengths.mean(),
        "curvature": _mean_curvature(mesh) * lengths.mean(),
    }


def statistic_distances(mesh: Mesh, reference: Mesh) -> dict[str, float]:
    """Wasserstein-1 distances between the local statistics of two meshes, in the statistics' units."""
    ours, theirs = local_statistics(mesh), local_statistics(reference)
    return {name: float(scipy.stats.wasserstein_distance(ours[name], theirs[name])) for name in ours}


def _dihedral_angles(mesh: Mesh) -> np.ndarray:
    """(P,) of the edges between two faces."""
    one, other = paired_sides(mesh.faces, len(mesh.vertices)).T // 3
    normals = unit(mesh.face_crosses)
    centres = mesh.vertices[mesh.faces].astype(np.float64).mean(1)
    angle = np.arccos(np.clip((normals[one] * normals[other]).sum(1), -1, 1))
    convex = ((centres[other] - centres[one]) * normals[one]).sum(1) <= 0
    return np.where(convex, angle, -angle)


def _mean_curvature(mesh: Mesh) -> np.ndarray:
    """(V,) by the cotangent formula (Meyer et al. 2003, equation 8), with a third of the area around."""
    count, points = len(mesh.vertices), mesh.vertices.astype(np.float64)
    pairs, weights = cotangent_weights(mesh)
    edge = weights[:, None] * (points[pairs[:, 0]] - points[pairs[:, 1]])
    total = scatter_add(pairs[:, 0], edge, count) - scatter_add(pairs[:, 1], edge, count)
    normal = total / np.maximum(vertex_areas(mesh), LEAST)[:, None]  # 2 H n
    return 0.5 * (normal * mesh.normals).sum(1)
