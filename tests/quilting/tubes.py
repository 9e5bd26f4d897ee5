"""Meshes whose flat map is known."""

from __future__ import annotations

import numpy as np

from mitex.mesh import Mesh


def tube(
    radius: float = 1.0, height: float = 2.0, around: int = 96, rows: int = 32, cut: bool = False
) -> tuple[Mesh, np.ndarray]:
    """An open tube around the y axis, and (V,) the angles of its vertices, which grow to the right.

    Args:
        radius, height: of it.
        around, rows: squares.
        cut: the vertices at the angle pi are there twice.
    """
    turn = np.linspace(-np.pi, np.pi, around + 1)
    level = height * np.linspace(-0.5, 0.5, rows + 1)
    angle, y = (a.ravel() for a in np.meshgrid(turn, level))
    points = np.stack([radius * np.sin(angle), y, radius * np.cos(angle)], 1).astype(np.float32)
    column = np.append(np.arange(around), around if cut else 0)
    number = np.arange(rows + 1)[:, None] * (around + 1) + column
    if cut:
        points[around :: around + 1] = points[:: around + 1]
    a, b, c, d = (n.ravel() for n in (number[:-1, :-1], number[:-1, 1:], number[1:, :-1], number[1:, 1:]))
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    used, faces = np.unique(faces, return_inverse=True)
    return Mesh(points[used], faces.reshape(-1, 3), name="tube"), angle[used]


def cup(wall: float = 0.1) -> Mesh:
    """A tube of radius 1 and height 2 that goes on over a level rim on top and down again inside."""
    mesh, _ = tube(height=1.0, rows=80)
    x, share, z = mesh.vertices.T
    corners = np.cumsum([0, 2, wall, 2])
    along = (share + 0.5) * corners[-1]
    radius = np.interp(along, corners, [1, 1, 1 - wall, 1 - wall])
    return mesh.with_vertices(
        np.stack([radius * x, np.interp(along, corners, [-1, 1, 1, -1]), radius * z], 1)
    )


def joined(*meshes: Mesh) -> Mesh:
    """Several meshes as one, without UVs."""
    starts = np.cumsum([0, *(len(mesh.vertices) for mesh in meshes[:-1])])
    faces = [mesh.faces + start for mesh, start in zip(meshes, starts, strict=True)]
    return Mesh(np.concatenate([mesh.vertices for mesh in meshes]), np.concatenate(faces), name="joined")
