"""Where a user's mesh lies in the scene cube, and how large a texture is on it."""

from __future__ import annotations

import numpy as np

from mitex.errors import MeshError
from mitex.mesh import Mesh, Similarity

EXTENT = 1 / 1.2  # largest half extent of the mesh in the scene cube
UNWRAP_SIZE = 1024  # side of the map that charts are packed for [texels]


def in_scene_cube(mesh: Mesh) -> tuple[Mesh, Similarity]:
    """The mesh in the scene cube, with a margin for the shell; and the mesh's space -> scene cube.

    Raises:
        MeshError: all vertices are at one point.
    """
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    half = float((high - low).max()) / 2
    if half == 0:
        raise MeshError(f"all vertices of {mesh.name} are at one point", "check how it was exported")
    similarity = Similarity((low + high) / 2, half / EXTENT)
    return mesh.with_vertices(similarity.apply(mesh.vertices)), similarity


def uv_unit_length(mesh: Mesh) -> float:
    """Length of a unit of the UVs on the mesh [mesh units]: mean edge on the mesh by mean edge in the UVs.

    Raises:
        MeshError: the UVs have no area.
    """

    def mean_edge(corners: np.ndarray) -> float:
        return float(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).mean())

    flat = mean_edge(np.asarray(mesh.uv))
    if flat == 0:
        raise MeshError(f"the UVs of {mesh.name} have no area", "unwrap it again, or leave them out")
    return mean_edge(mesh.vertices[mesh.faces]) / flat
