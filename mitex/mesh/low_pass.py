"""Low-pass filters on meshes: of what vertices have, and of their places."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
from scipy.sparse import coo_array, diags_array

from mitex.mesh.connection import solver
from mitex.mesh.cotangents import cotangent_weights, vertex_areas
from mitex.mesh.mesh import Mesh

LEAST = 1e-12  # area around a vertex, at least, relative to the largest


def low_pass(mesh: Mesh, width: float) -> Callable[[np.ndarray], np.ndarray]:
    """A filter of second order (Butterworth) of what the vertices have, (V,) or (V, K).

    A wave of length L is multiplied by 1 / (1 + x^2), where x = (2 pi width / L)^2 / 2: waves of 4.4 widths
    are halved, of those of 2.2 a seventeenth is left. Lengths are along the surface.

    Args:
        mesh: any; what vertices without faces have stays.
        width: in units of the mesh.
    """
    count = len(mesh.vertices)
    pairs, weights = cotangent_weights(mesh)
    weights = np.maximum(weights, 0.0)  # negative ones, of obtuse triangles, would sharpen
    ends, others = np.concatenate([pairs, pairs[:, ::-1]]).T
    springs = coo_array((np.tile(weights, 2), (ends, others)), shape=(count, count)).tocsr()
    stiffness = diags_array(springs.sum(1)) - springs
    area = _areas(mesh)
    bending = stiffness @ diags_array(1 / area) @ stiffness
    solve = solver((diags_array(area) + (0.5 * width**2) ** 2 * bending).tocsc())
    return lambda values: solve((area * values.T).T)


def blurred(mesh: Mesh, width: float) -> Mesh:
    """The mesh after a low-pass filter of its vertices' places, as large as before; see `low_pass`.

    Args:
        mesh: any.
        width: of the filter, in units of the mesh; 0 changes nothing.
    """
    if width == 0:
        return mesh
    area, before = _areas(mesh), mesh.vertices.astype(np.float64)
    centre = np.average(before, axis=0, weights=area)
    away = low_pass(mesh, width)(before) - centre
    grown = np.average((before - centre) ** 2, axis=0, weights=area).sum()
    shrunk = np.average(away**2, axis=0, weights=area).sum()
    return mesh.with_vertices(centre + away * np.sqrt(grown / shrunk))


def _areas(mesh: Mesh) -> np.ndarray:
    area = vertex_areas(mesh)
    return np.maximum(area, LEAST * area.max())
