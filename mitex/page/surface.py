"""A mesh as the page's data holds it: positions, and vectors at its vertices, of 16 bits."""

from __future__ import annotations

from collections.abc import Mapping
from types import MappingProxyType
from typing import Any

import numpy as np

from mitex.errors import MeshError
from mitex.mesh import Mesh
from mitex.page.packing import differences, packed

STEPS = 2**16 - 1  # between the ends of an axis
EMPTY: Mapping[str, np.ndarray] = MappingProxyType({})


def quantised(mesh: Mesh) -> Mesh:
    """The mesh with the positions that it has in the page: off by half a step of 16 bits at most."""
    low, step, quanta = _grid(mesh.vertices)
    return Mesh(low + step * quanta, mesh.faces, name=mesh.name)


def mesh_data(mesh: Mesh, levels: int, fields: Mapping[str, np.ndarray] = EMPTY) -> dict[str, Any]:
    """A mesh as JSON values.

    Args:
        mesh: V vertices.
        levels: rounds of midpoint subdivision that the page makes before cells sit on the vertices.
        fields: vectors (V, 3) that its texture follows, by what they lead: its `motion`, or its `upwards`.

    Raises:
        MeshError: there are no faces that could be shown.
    """
    if not len(mesh.faces):
        raise MeshError(f"'{mesh.name}' has no faces", "give a mesh with a surface")
    indices = mesh.faces.astype(np.uint16 if len(mesh.vertices) <= STEPS else np.uint32)
    return {
        "name": mesh.name,
        "levels": levels,
        "positions": _rows_data(mesh.vertices),
        "faces": packed(differences(indices)),
        "fields": {name: _rows_data(vectors) for name, vectors in fields.items()},
    }


def _rows_data(rows: np.ndarray) -> dict[str, Any]:
    low, step, quanta = _grid(rows)
    return {"low": low.tolist(), "step": step.tolist(), "steps": packed(differences(quanta))}


def _grid(rows: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """The lowest row (3,), the steps (3,) and the rows in steps from it (V, 3) uint16."""
    rows = rows.astype(np.float64)
    low = rows.min(axis=0)
    step = np.ptp(rows, axis=0) / STEPS
    quanta = np.round((rows - low) / np.where(step > 0, step, 1.0)).astype(np.uint16)
    return low, step, quanta
