"""Which way the ridges of a relief run along a surface, by the structure tensor of its normals.

Where a relief is a height h over a surface, its normal leans by minus the gradient g of h. Ridges run across
the direction in which it leans most, whatever the sign: along the eigenvector of the smaller eigenvalue of
the structure tensor, the mean of g g^T over a neighbourhood (Bigun and Granlund 1987). With g as a complex
number whose real axis is the field, that mean is one of g^2, and half the angle of -g^2 is the ridges'.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.errors import MeshError
from mitex.geometry.vectors import across, dot, scatter_add, unit
from mitex.mesh import Mesh

ROUNDS = 2  # of the mean over the faces around the corners


@dataclass(frozen=True)
class ReliefDirection:
    """Ridges beside a field; angles in degrees.

    Attributes:
        turn: from the field to the ridges on the whole, counter-clockwise, in (-90, 90].
        error: mean angle between field and ridges, weighted by how clear they are: 0 along it, 90 across it,
            and 45 where they have nothing to do with it.
        coherence: 1 if all ridges have one angle to the field, 0 if they have all angles alike.
    """

    turn: float
    error: float
    coherence: float


def relief_direction(base: Mesh, relief: Mesh, field: np.ndarray) -> ReliefDirection:
    """Compares the ridges of a relief with a field.

    Args:
        base: the surface without the relief.
        relief: with it; its faces are those of `base`.
        field: (V, 3) vectors at the vertices of `base`; faces without a direction do not count.

    Raises:
        MeshError: the meshes have other faces, or no normal differs where the field has a direction.
    """
    if not np.array_equal(base.faces, relief.faces):
        raise MeshError(f"{base.name} and {relief.name} differ in their faces", "give the same mesh twice")
    normals = base.face_normals.astype(np.float64)
    along = unit(across(field[base.faces].astype(np.float64).mean(1), normals))
    lean = relief.face_normals - normals
    gradient = dot(lean, along) + 1j * dot(lean, np.cross(normals, along))
    tensor = base.face_areas * gradient**2
    if not np.abs(tensor).any():
        raise MeshError(f"{relief.name} has no relief where the field has a direction", "give another mesh")
    whole, local = tensor.sum(), _around(base, tensor)
    error = (np.abs(_ridge(local)) * np.abs(local)).sum() / np.abs(local).sum()
    return ReliefDirection(float(_ridge(whole)), float(error), float(np.abs(whole) / np.abs(tensor).sum()))


def _ridge(tensor: np.ndarray) -> np.ndarray:
    """Angle of ridges from the field [degrees]."""
    return np.degrees(np.angle(-tensor)) / 2


def _around(mesh: Mesh, values: np.ndarray) -> np.ndarray:
    """(F,) complex sums over the faces around, those nearer with larger weights."""
    rows = np.stack([np.real(values), np.imag(values)], 1)
    for _ in range(ROUNDS):
        corners = scatter_add(mesh.faces.ravel(), np.repeat(rows, 3, axis=0), len(mesh.vertices))
        rows = corners[mesh.faces].sum(1)
    return rows[:, 0] + 1j * rows[:, 1]
