"""Where an exemplar's right and up point on the surface (Kovacs et al. 2024, section 3.1, "Tangent Frame").

The paper takes a fixed vector w and, by Gram-Schmidt, what of it lies across the normal, or another vector w'
where the two are parallel. It allows for smoother frames: "smooth" is a direction field that follows w where
w says something and is as parallel as possible elsewhere, in the manner of Knoppel, Crane, Pinkall and
Schroder, "Globally optimal direction fields" (2013): complex numbers in the vertices' tangent planes, and a
sparse linear system. The authors' frames are left-handed seen from outside, which mirrors the exemplar; here
right x up is the outward normal.
"""

from __future__ import annotations

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import across, dot, orthonormal, rotate_about, scatter_add, unit, unit_normals
from mitex.mesh import Mesh
from mitex.mesh.connection import connection_laplacian, solver, tangent_axes, transport
from mitex.mesh.topology import mesh_edges, welded

KINDS = ("fixed", "smooth")
UP = np.array([0.0, 1.0, 0.0])  # w: image up
SPARE_UP = np.array([0.0, 0.0, -1.0])  # w', image up where the surface is level: seen from above, right is +x
PARALLEL = 1e-3  # w' where 1 - |cos| of the angle between normal and w is smaller, 2.6 degrees
FIDELITY = 100.0  # pull to the fixed field against smoothness; directions adapt over 0.13 sqrt(area)
LEVEL_PULL = 0.05  # how strongly level places are pulled to w', relative to upright ones to w
FAINT = 1e-6  # vectors shorter than that have no direction


def interpolate_frames(
    mesh: Mesh, face: np.ndarray, barycentric: np.ndarray, directions: np.ndarray, angle: float = 0.0
) -> tuple[np.ndarray, np.ndarray]:
    """The exemplar's right and up at points of the surface.

    Directions of the vertices are interpolated, projected onto the plane of the flat face, and normalised;
    where they cancel, any direction across the normal is taken, always the same.

    Args:
        mesh: V vertices, F faces.
        face: (M,) the faces that the points lie on.
        barycentric: (M, 3) where on them.
        directions: (V, 3) unit, where right points at the vertices (`vertex_directions`).
        angle: turns both counter-clockwise seen from outside [rad].

    Returns:
        Right and up, (M, 3) float64 each, orthonormal, across the face's normal; right x up is the outward
        normal. Faces without an area have frames across +z.
    """
    face = np.asarray(face)
    normal = unit_normals(mesh.face_crosses[face])
    right = interpolate(np.asarray(barycentric), directions[mesh.faces[face]])
    right = rotate_about(orthonormal(_without_faint(right), normal), normal, angle)
    return right, np.cross(normal, right)


def vertex_directions(mesh: Mesh, kind: str = "smooth", field: np.ndarray | None = None) -> np.ndarray:
    """(V, 3) float64 unit vectors across the vertex normals: where right points.

    Vertices at one place have one normal and one direction.

    Args:
        mesh: V vertices.
        kind: "fixed", as in the paper: right is y x normal. "smooth": alike where the surface is upright,
            smooth elsewhere.
        field: (V, 3) where up should point, of any length and direction, in place of `kind`. Where it is zero
            or along the normal, the fixed direction is taken.

    Raises:
        ConfigError: an unknown kind, or a field of another shape or with numbers that are not finite.
    """
    if kind not in KINDS:
        raise ConfigError(f"unknown tangent frames {kind!r}", f"use one of {', '.join(KINDS)}")
    place = welded(mesh.vertices)
    corners = place[mesh.faces]
    count = int(place.max(initial=-1)) + 1
    normals = unit_normals(scatter_add(corners.ravel(), np.repeat(mesh.face_crosses, 3, axis=0), count))
    directions = _fixed(normals)
    if field is not None:
        target = scatter_add(place, _checked(field, len(place)), count)
        target = _without_faint(across(target, normals))
        right = np.cross(orthonormal(target, normals), normals)
        directions = np.where(target.any(axis=1, keepdims=True), right, directions)
    elif kind == "smooth":
        areas = np.linalg.norm(mesh.face_crosses, axis=1) / 6.0
        share = np.bincount(corners.ravel(), np.repeat(areas, 3), count)
        directions = _smooth(normals, share, mesh_edges(corners, count)[0], directions)
    return directions[place]


def _fixed(normals: np.ndarray) -> np.ndarray:
    level = 1.0 - np.abs(normals @ UP) < PARALLEL
    return orthonormal(np.cross(np.where(level[:, None], SPARE_UP, UP), normals), normals)


def _smooth(normals: np.ndarray, areas: np.ndarray, edges: np.ndarray, spare: np.ndarray) -> np.ndarray:
    """Minimises sum_edges |u_i - r_ij u_j|^2 + lambda sum_i A_i |u_i - q_i|^2 over complex u.

    r_ij carries a direction from j to i by the smallest rotation between the normals. q_i is y x n_i, whose
    length is the sine of their angle, plus a little of w' x n_i at level places: else a level plane would
    have no direction at all. The first sum does not depend on the units, nor much on the resolution; lambda =
    `FIDELITY` / sum_i A_i makes the same of the second.

    Args:
        normals: (V, 3) unit.
        areas: (V,) A_i [mesh units^2].
        edges: (E, 2) vertex pairs.
        spare: (V, 3) unit, across the normals, taken where the solution vanishes.
    """
    from scipy.sparse import diags_array

    count = len(normals)
    x, y = tangent_axes(normals)
    pull = FIDELITY * np.maximum(areas / max(areas.sum(), np.finfo(np.float64).tiny), 1e-6 / count)
    upright = np.cross(UP, normals)
    tilt = np.linalg.norm(upright, axis=1, keepdims=True)
    target = upright + LEVEL_PULL * np.maximum(1.0 - 2.0 * tilt, 0.0) * np.cross(SPARE_UP, normals)
    q = dot(target, x) + 1j * dot(target, y)
    laplacian = connection_laplacian(edges, transport(normals, x, y, edges), np.ones(len(edges)), count)
    u = solver((laplacian + diags_array(pull)).tocsc())(pull * q)
    solution = _without_faint(np.real(u)[:, None] * x + np.imag(u)[:, None] * y)
    return np.where(solution.any(axis=1, keepdims=True), orthonormal(solution, normals), spare)


def _checked(field: np.ndarray, vertices: int) -> np.ndarray:
    """The field with unit vectors and zeros."""
    field = np.asarray(field, np.float64)
    if field.shape != (vertices, 3):
        raise ConfigError(
            f"an orientation field of shape {field.shape}", f"give one of shape {(vertices, 3)}"
        )
    if not np.isfinite(field).all():
        raise ConfigError(
            "an orientation field with NaN or infinite entries", "use zeros where it is unknown"
        )
    largest = np.abs(field).max(axis=1, keepdims=True, initial=0.0)
    return unit(field / np.where(largest > 0.0, largest, 1.0))  # first: squares may overflow


def _without_faint(vectors: np.ndarray) -> np.ndarray:
    return np.where(np.linalg.norm(vectors, axis=1, keepdims=True) > FAINT, vectors, 0.0)
