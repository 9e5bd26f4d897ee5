"""Small meshes by formula that are no sound surfaces."""

from dataclasses import replace

import numpy as np

from mitex.mesh import Mesh


def moebius(pieces: int = 20) -> Mesh:
    """A strip whose end is turned over before it meets its start."""
    t = np.arange(pieces) * 2 * np.pi / pieces
    sides = []
    for s in (-0.3, 0.3):
        reach = 1 + s * np.cos(t / 2)
        sides.append(np.stack([reach * np.cos(t), s * np.sin(t / 2), reach * np.sin(t)], 1))
    a = 2 * np.arange(pieces)
    c, d = (a + 2) % (2 * pieces), (a + 3) % (2 * pieces)
    c[-1], d[-1] = d[-1], c[-1]
    faces = np.concatenate([np.stack([a, a + 1, c], 1), np.stack([a + 1, d, c], 1)])
    return Mesh(np.stack(sides, 1).reshape(-1, 3), faces, name="strip")


def turned(mesh: Mesh) -> Mesh:
    """A mesh, one face of which has its back outside."""
    faces = mesh.faces.copy()
    faces[0] = faces[0, ::-1]
    return replace(mesh, faces=faces, uv=None, name="turned")


def collapsed(mesh: Mesh) -> Mesh:
    """A mesh, one side of which has no length, and the faces there no area."""
    vertices = mesh.vertices.copy()
    vertices[mesh.faces[0, 0]] = vertices[mesh.faces[0, 1]]
    return replace(mesh, vertices=vertices, name="collapsed")


def pair(mesh: Mesh) -> Mesh:
    """Two copies side by side."""
    vertices = np.concatenate([mesh.vertices, mesh.vertices + [3.0, 0, 0]])
    return Mesh(vertices, np.concatenate([mesh.faces, mesh.faces + len(mesh.vertices)]), name="pair")


def fan() -> Mesh:
    """Three faces on one edge."""
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1], [0, -1, -1]]
    return Mesh(np.array(points, float), np.array([[0, 1, 2], [1, 0, 3], [0, 1, 4]]), name="fan")
