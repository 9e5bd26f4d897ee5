"""How thick a mesh is, and dents that are no deeper than that: on thin walls they would meet."""

from __future__ import annotations

import numpy as np
from scipy.spatial import KDTree

from mitex.mesh import Mesh

MOST = 10.0  # that is told apart [mean edges]
LESS = 0.99  # of its size, to which a ball shrinks at least, or else it is done
DEEPEST = 0.45  # of the thickness: two dents that face each other do not meet


def thickness(mesh: Mesh) -> np.ndarray:
    """(V,) float64 diameters of the largest balls inside that touch a mesh at its vertices [mesh units].

    They shrink until no vertex is in them (Ma, Bae and Choi 2012, "3D medial axis point approximation using
    nearest neighbors and the normal field"), from `MOST` mean edges on.
    """
    vertices, normals = mesh.vertices.astype(np.float64), mesh.normals
    tree, radii = KDTree(vertices), np.full(len(vertices), 0.5 * MOST * mesh.edge_lengths.mean())
    rest = np.arange(len(vertices))
    while len(rest):
        _, nearest = tree.query(vertices[rest] - radii[rest, None] * normals[rest])
        way = vertices[nearest] - vertices[rest]
        depth = -2 * (way * normals[rest]).sum(1)
        touching = np.divide((way * way).sum(1), depth, out=radii[rest], where=depth > 0)
        smaller = touching < LESS * radii[rest]
        rest = rest[smaller]
        radii[rest] = touching[smaller]
    return 2 * radii


def shallow(before: Mesh, after: Mesh, thick: np.ndarray) -> Mesh:
    """A displaced mesh whose dents never reach `DEEPEST` of a thickness; what is raised stays.

    Args:
        before: the mesh without the displacement, with the faces of `after`.
        after: the displaced mesh.
        thick: (V,) the thickness of `before` [mesh units].
    """
    inward = np.maximum(((before.vertices - after.vertices) * before.normals).sum(1), 0.0)
    kept = DEEPEST * thick * np.tanh(inward / (DEEPEST * thick))
    return after.with_vertices(after.vertices + (inward - kept)[:, None] * before.normals)
