"""The base shape: a smooth, evenly meshed stand-in for an object without its meso-structure.

Section 3.1.1 of NeRF-Texture (Huang et al. 2023).
"""

from __future__ import annotations

import math
import warnings
from dataclasses import replace

import numpy as np

from mitex.errors import MeshError, MeshWarning
from mitex.geometry.vectors import orthonormal
from mitex.mesh import Mesh, remesh
from mitex.mesh.matrices import ring_means
from mitex.mesh.remesh import simplified
from mitex.mesh.topology import boundary_edges, components
from mitex.methods.nerf.base.convex_parts import convex_parts, union
from mitex.methods.nerf.base.isosurface import isosurface, without_cavities
from mitex.methods.nerf.field.projection import Projection

DENSE = 10.0  # density above which there is the object [1 / scene units]
EDGE = 0.005  # of the bounding box's diagonal
SMALL = 0.2  # of the largest component's faces: smaller components are dropped
FACES = 5_000  # of the mesh that is cut into convex pieces
CELLS = 2.0  # edges of the base shape that make a cell of the grid on which the pieces are united
ROUNDS = 5  # of Laplacian smoothing
FINE = 2.0  # edges may be so many times longer than asked for, or a given base mesh is remeshed
PERCENTILE = 70.0  # of the scan's distances, see `shell_thickness`
CUBE = 1.001  # the scene cube with a little room for rounding


def base_shape(
    density: np.ndarray,
    *,
    concavity: float = 0.1,
    edge: float = EDGE,
) -> Mesh:
    """The union of convex pieces of what is dense, smoothed and meshed evenly.

    Args:
        density: (R, R, R) float32, indexed by x, y, z, at the centres of R^3 cells of the scene cube
            [-1, 1]^3 [1 / scene units].
        concavity: how far the pieces may be from the object, in (0, 1]; large ones smooth more.
        edge: length of the edges [diagonals of the object's bounding box].

    Returns:
        A closed mesh in the scene cube with the bounding box of the object.

    Raises:
        MeshError: the density is not finite or nowhere above 10.
        MissingPackage: a package of the extra `nerf` is not installed.
    """
    if not np.isfinite(density).all():
        raise MeshError("the coarse density is not finite", "lower the learning rate, or give `base_mesh`")
    if not (density > DENSE).any():
        problem = f"the coarse density is nowhere above {DENSE:g}"
        raise MeshError(problem, "check masks and cameras, train it for longer, or give `base_mesh`")
    # Without the clipping, linear interpolation would put the surface at the outermost samples.
    clipped = np.clip(density, 0.0, 2.0 * DENSE)
    cell = 2.0 / len(density)
    low = np.full(3, 0.5 * cell - 1.0)
    dense = isosurface(without_cavities(clipped, DENSE), DENSE, low=low, cell=cell, name="base")
    dense = _large_components(dense)
    length = edge * _diagonal(dense)
    parts = convex_parts(simplified(dense, FACES) if len(dense.faces) > FACES else dense, concavity)
    rough = replace(union(parts, CELLS * length), name=dense.name)
    return _even(_into_box(_smoothed(rough), dense), length)


def given_base(mesh: Mesh, edge: float = EDGE) -> Mesh:
    """A base mesh of the user's, meshed evenly unless its edges are short already; holes stay.

    A closed mesh whose faces look inwards is turned, with a `MeshWarning`.

    Args:
        mesh: in the scene cube.
        edge: length of the edges [diagonals of the bounding box].

    Raises:
        MeshError: it has no faces, or is not in the scene cube.
    """
    if not len(mesh.faces):
        raise MeshError(f"{mesh.name} has no faces", "give a surface as the base mesh")
    if np.abs(mesh.vertices).max(initial=0.0) > CUBE:
        problem = f"{mesh.name} reaches out of the scene cube [-1, 1]^3"
        raise MeshError(problem, "scale and move it to where the cameras see the object")
    if not len(boundary_edges(mesh.faces, len(mesh.vertices))) and _volume(mesh) < 0.0:
        warnings.warn(f"{mesh.name}: faces look inwards and were turned", MeshWarning, stacklevel=2)
        uv = None if mesh.uv is None else mesh.uv[:, ::-1]
        mesh = Mesh(mesh.vertices, mesh.faces[:, ::-1], uv, mesh.name)
    length = edge * _diagonal(mesh)
    longest = np.linalg.norm(mesh.vertices[mesh.edges.rows] - mesh.vertices[mesh.edges.indices], axis=1).max()
    return mesh if longest <= FINE * length else _even(mesh, length)


def face_frames(mesh: Mesh) -> np.ndarray:
    """The fixed frames T_c of the faces.

    Tangents point where u grows. Without UVs they follow the direction that is the most tangential on the
    whole: unlike those of new charts, such frames turn slowly from face to face nearly everywhere.

    Returns:
        (F, 3, 3) float32 rows t, b, n: orthonormal, right-handed, n the face's normal.
    """
    n = mesh.face_normals.astype(np.float64)
    if mesh.uv is None:
        spread = np.einsum("f,fi,fj->ij", mesh.face_areas, n, n)
        along = np.broadcast_to(np.linalg.eigh(spread)[1][:, 0], n.shape)
    else:
        p, uv = (a.astype(np.float64) for a in (mesh.vertices[mesh.faces], mesh.uv))
        dp, (du, dv) = p[:, 1:] - p[:, :1], np.moveaxis(uv[:, 1:] - uv[:, :1], 2, 0)
        area = du[:, :1] * dv[:, 1:] - du[:, 1:] * dv[:, :1]
        along = np.sign(area) * (dv[:, 1:] * dp[:, 0] - dv[:, :1] * dp[:, 1])
    t = orthonormal(along, n)
    return np.stack([t, np.cross(n, t), n], axis=1).astype(np.float32)


def shell_thickness(points: np.ndarray, projection: Projection) -> float:
    """How far the shell reaches on either side: twice the 70th percentile of the distances of a scan.

    Args:
        points: (N, 3) on the object's surface [scene units].
        projection: onto the base shape, without a reach.

    Raises:
        MeshError: no point has a foot.
    """
    projections = projection(points)
    if not projections.hit.any():
        raise MeshError("no point of the scan projects onto the base shape", "check the base mesh's place")
    return 2.0 * float(np.percentile(np.abs(projections.distance[projections.hit]), PERCENTILE))


def _large_components(mesh: Mesh) -> Mesh:
    label = components(mesh.edges)[1][mesh.faces[:, 0]]
    size = np.bincount(label)
    large = mesh.faces[(size >= SMALL * size.max())[label]]
    used, faces = np.unique(large, return_inverse=True)
    return Mesh(mesh.vertices[used], faces.reshape(-1, 3), name=mesh.name)


def _smoothed(mesh: Mesh) -> Mesh:
    """Laplacian smoothing: in each of some rounds, every vertex moves to the mean of its neighbours."""
    mean, vertices = ring_means(mesh), mesh.vertices.astype(np.float64)
    for _ in range(ROUNDS):
        vertices = mean @ vertices
    return mesh.with_vertices(vertices)


def _into_box(mesh: Mesh, other: Mesh) -> Mesh:
    """The mesh stretched along the axes to another's bounding box."""
    low, high = mesh.vertices.min(0), mesh.vertices.max(0)
    target_low, target_high = other.vertices.min(0), other.vertices.max(0)
    return mesh.with_vertices(
        target_low + (mesh.vertices - low) * ((target_high - target_low) / (high - low))
    )


def _even(mesh: Mesh, length: float) -> Mesh:
    """The mesh with equilateral faces, nearly, whose edges are about as long as `length`."""
    area = float(mesh.face_areas.sum(dtype=np.float64))
    return remesh(mesh, max(12, round(2.0 * area / (math.sqrt(3.0) * length**2))))


def _diagonal(mesh: Mesh) -> float:
    return float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))


def _volume(mesh: Mesh) -> float:
    """Of a closed mesh; negative where faces look inwards."""
    corner = mesh.vertices[mesh.faces[:, 0]].astype(np.float64)
    return float((corner * mesh.face_crosses).sum() / 6.0)
