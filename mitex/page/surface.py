"""A mesh as the page's data holds it: positions of 16 bits."""

from __future__ import annotations

from typing import Any

import numpy as np

from mitex.errors import MeshError
from mitex.mesh import Mesh
from mitex.page.packing import differences, packed

STEPS = 2**16 - 1  # between the ends of an axis


def quantised(mesh: Mesh) -> Mesh:
    """The mesh with the positions that it has in the page: off by half a step of 16 bits at most."""
    low, step, quanta = _grid(mesh)
    return Mesh(low + step * quanta, mesh.faces, name=mesh.name)


def mesh_data(mesh: Mesh, levels: int) -> dict[str, Any]:
    """A mesh as JSON values.

    Args:
        mesh: the mesh.
        levels: rounds of midpoint subdivision that the page makes before cells sit on the vertices.

    Raises:
        MeshError: there are no faces that could be shown.
    """
    if not len(mesh.faces):
        raise MeshError(f"'{mesh.name}' has no faces", "give a mesh with a surface")
    low, step, quanta = _grid(mesh)
    indices = mesh.faces.astype(np.uint16 if len(mesh.vertices) <= STEPS else np.uint32)
    return {
        "name": mesh.name,
        "levels": levels,
        "low": low.tolist(),
        "step": step.tolist(),
        "positions": packed(differences(quanta)),
        "faces": packed(differences(indices)),
    }


def _grid(mesh: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The lowest position (3,), the steps (3,) and the positions in steps from it (V, 3) uint16."""
    positions = mesh.vertices.astype(np.float64)
    low = positions.min(axis=0)
    step = np.ptp(positions, axis=0) / STEPS
    quanta = np.round((positions - low) / np.where(step > 0, step, 1.0)).astype(np.uint16)
    return low, step, quanta
