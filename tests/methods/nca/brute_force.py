"""The cell rule as loops over vertices and edges, from the equations; and small meshes for it."""

import math

import numpy as np
import torch
from scipy.spatial.transform import Rotation

from mitex.mesh import Mesh, grid, icosphere


def neighbours(mesh: Mesh) -> list[list[int]]:
    """Of every vertex, from the faces."""
    rings: list[set[int]] = [set() for _ in mesh.vertices]
    for a, b, c in mesh.faces.tolist():
        for i, j in ((a, b), (b, c), (c, a)):
            rings[i].add(j)
            rings[j].add(i)
    return [sorted(ring) for ring in rings]


def harmonics(d: list[float], degree: int) -> list[float]:
    """The authors' weights of a unit direction: no constants."""
    x, y, z = d
    terms = [1.0, y, z, x, x * y, y * z, 3 * z * z - 1, x * z, x * x - y * y]
    return terms[: (degree + 1) ** 2]


def direction(mesh: Mesh, i: int, j: int, angle: float = 0.0) -> list[float]:
    """Of the edge j -> i, turned back by `angle` about the normal of i."""
    offset = mesh.vertices[j].astype(float) - mesh.vertices[i].astype(float)
    length = math.sqrt(float(offset @ offset))
    d = offset / length if length else offset
    if angle:
        d = Rotation.from_rotvec(-angle * mesh.normals[i].astype(float)).apply(d)
    return d.tolist()


def perceive(mesh: Mesh, state: list[list[float]], degree: int = 1, angles: list[float] | None = None):
    """Perception vectors of all vertices: one block of channels for each harmonic, then the state."""
    vectors = []
    for i, ring in enumerate(neighbours(mesh)):
        blocks = [[0.0] * len(state[i]) for _ in range((degree + 1) ** 2)]
        for j in ring:
            d = direction(mesh, i, j, angles[i] if angles else 0.0)
            for block, weight in zip(blocks, harmonics(d, degree), strict=True):
                for c in range(len(block)):
                    block[c] += weight * (state[j][c] - state[i][c])
        vectors.append([value for block in blocks for value in block] + list(state[i]))
    return vectors


def linear(layer: torch.nn.Linear, x: list[float]) -> list[float]:
    rows = zip(layer.weight.tolist(), layer.bias.tolist(), strict=True)
    return [sum(w * v for w, v in zip(row, x, strict=True)) + b for row, b in rows]


def step(model, mesh: Mesh, state: torch.Tensor, mask=None, condition=None, angles=None) -> torch.Tensor:
    """One step of one state (V, C), equations 1 to 3, in Python floats."""
    after = []
    inputs = perceive(mesh, state.tolist(), model.degree, angles)
    for i, (own, x) in enumerate(zip(state.tolist(), inputs, strict=True)):
        if condition is not None:
            x = x + condition[i].tolist()
        hidden = [max(h, 0.0) for h in linear(model.fc1, x)]
        change = linear(model.fc2, hidden)
        updates = mask is None or bool(mask[i])
        after.append([s + c for s, c in zip(own, change, strict=True)] if updates else own)
    return torch.tensor(after, dtype=torch.float64)


def patchwork(seed: int = 0) -> Mesh:
    """An open, jittered patch, a closed blob beside it, and two vertices without edges."""
    rng = np.random.default_rng(seed)
    patch, blob = grid(4, 3), icosphere(1)
    points = [patch.vertices, 0.5 * blob.vertices + (3, 0, 0), rng.normal(size=(2, 3))]
    vertices = np.concatenate(points)
    vertices = vertices + 0.1 * rng.normal(size=vertices.shape)
    return Mesh(vertices, np.concatenate([patch.faces, blob.faces + len(patch.vertices)]))


def turned(mesh: Mesh, rotation: Rotation) -> Mesh:
    return mesh.with_vertices(rotation.apply(mesh.vertices.astype(float)))
