"""Rays on meshes, and where they end."""

import numpy as np
from scipy.spatial import Delaunay

from mitex.mesh import Mesh, icosphere
from mitex.methods.surface.exponential import Arrival


def positions(mesh: Mesh, face, weights) -> np.ndarray:
    return np.einsum("mk,mkd->md", weights, mesh.vertices[mesh.faces[face]].astype(np.float64))


def end_points(mesh: Mesh, arrival: Arrival) -> np.ndarray:
    """(M, 3) positions; also checks what holds for every arrival."""
    assert arrival.face.dtype == np.int32 and arrival.barycentric.dtype == np.float64
    assert arrival.arrived.dtype == bool
    assert arrival.face.min() >= 0 and arrival.face.max() < len(mesh.faces)
    assert arrival.barycentric.min() >= 0.0
    np.testing.assert_allclose(arrival.barycentric.sum(axis=1), 1.0, atol=1e-14)
    return positions(mesh, arrival.face, arrival.barycentric)


def random_rays(mesh: Mesh, count: int, rng, faces=None):
    """Random faces, coordinates and unit directions in the faces' planes."""
    face = rng.choice(np.arange(len(mesh.faces)) if faces is None else faces, count)
    weights = rng.dirichlet([1.0, 1.0, 1.0], count)
    normal = mesh.face_crosses[face]
    direction = np.cross(normal, rng.normal(size=(count, 3)))
    return face, weights, direction / np.linalg.norm(direction, axis=1, keepdims=True)


def locate(mesh: Mesh, point) -> tuple[np.ndarray, np.ndarray]:
    """A face of a mesh in the xy plane that holds a point, and its coordinates there."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)[..., :2]
    for face in np.flatnonzero(np.abs(mesh.face_crosses[:, 2]) > 0):
        weights = np.linalg.solve(np.vstack([corners[face].T, np.ones(3)]), [*point, 1.0])
        if weights.min() >= -1e-12:
            return np.array([face]), weights[None]
    raise AssertionError("outside")


def bumpy(rng, frequency: int = 6) -> Mesh:
    mesh = icosphere(frequency)
    return mesh.with_vertices(mesh.vertices * rng.uniform(0.8, 1.2, (len(mesh.vertices), 1)))


def plane(rng, count: int = 400) -> Mesh:
    """The unit square, triangulated irregularly; lifted to a slanted plane that float32 holds exactly."""
    inner = rng.integers(1, 1024, (count, 2))
    border = np.linspace(0, 1024, 9)
    sides = [np.column_stack(p) for b in (0 * border, 1024 + 0 * border) for p in ((border, b), (b, border))]
    xy = np.unique(np.concatenate([inner, *sides]) / 1024.0, axis=0)
    faces = rng.permuted(Delaunay(xy).simplices, axis=1)
    return Mesh(np.column_stack([xy, 0.5 * xy[:, 0] + 0.25 * xy[:, 1]]), faces)
