"""A vector field of one mesh on another mesh of nearly the same surface."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitex.geometry.triangles import interpolate
from mitex.mesh.fields.field import vector_field
from mitex.mesh.mesh import Mesh
from mitex.mesh.nearest import surface_points

OF_VERTICES = (".npy", ".ply")  # files of vectors that belong to the vertices of one mesh


def carried_field(base: Mesh, mesh: Mesh, source: str | Path | np.ndarray) -> np.ndarray:
    """The `vector_field` of a mesh, from a source that may be of the vertices of another mesh.

    Args:
        base: the mesh to whose vertices the vectors of a file or an array belong.
        mesh: V vertices; the same mesh, or one of nearly the same surface.
        source: see `mitex.mesh.fields`.

    Returns:
        (V, 3) float32, across `mesh.normals`, of mean length 1.

    Raises:
        ConfigError, MeshError: as of `vector_field`.
    """
    own = isinstance(source, np.ndarray) or Path(source).suffix.lower() in OF_VERTICES
    if own and mesh is not base:
        vectors = vector_field(base, source).astype(np.float64)
        face, weights = surface_points(base, mesh.vertices.astype(np.float64))
        source = interpolate(weights, vectors[base.faces[face]])
    return vector_field(mesh, source)
