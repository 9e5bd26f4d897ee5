"""Checks that a mesh can be used, and repairs of what can be repaired."""

from __future__ import annotations

import warnings
from dataclasses import replace

import numpy as np

from mitex.errors import MeshError, MeshWarning
from mitex.geometry.vectors import dot, unit
from mitex.mesh.mesh import Mesh
from mitex.mesh.polygons import Polygons
from mitex.mesh.topology import components, mesh_edges, opposed_edges

# A face is degenerate if its height is below this part of its longest side.
FLAT = 1e-10
# Longest side of the box: its squares stay in single precision.
SMALLEST, LARGEST = 1e-15, 1e15
OPPOSITE = 0.01  # part of the area where normals may look away from the faces


def validate(
    vertices: np.ndarray,
    faces: np.ndarray,
    uv: np.ndarray | None = None,
    *,
    name: str = "mesh",
    max_vertices: int = 2_000_000,
    corner_normals: np.ndarray | None = None,
    polygons: Polygons | None = None,
) -> Mesh:
    """Makes a mesh of arrays from outside: refuses what cannot be used, mends and reports what can.

    Degenerate faces (no area), repeated faces (same three vertices) and vertices without a face are dropped.
    Edges of more than two faces, neighbours of opposite winding and separate components are kept. UVs that
    are not finite are dropped, and so are corner normals if one is not finite or zero, or if they look away
    from the faces on more than 1 % of the area. One `MeshWarning` each.

    Args:
        vertices: (V, 3) positions.
        faces: (F, 3) integer indices.
        uv: (F, 3, 2) per face corner, or None.
        name: for messages.
        max_vertices: budget.
        corner_normals: (F, 3, 3) of any length, or None.
        polygons: those of the faces, or None.

    Returns:
        The mesh; vertices and faces that stay keep their order. Polygons of dropped faces become triangles;
        corner normals are None where they are the smooth ones anyway.

    Raises:
        MeshError: no vertices, no faces, over budget, wrong shape, an index out of range, NaN or infinite
            positions, no face with an area, a box whose longest side is not from 1e-15 to 1e15.
    """
    if not len(vertices):
        raise MeshError(f"{name} is empty: it has no vertices", "check how it was exported")
    if len(vertices) > max_vertices:
        problem = f"{name} has {len(vertices):,} vertices, more than the budget of {max_vertices:,}"
        raise MeshError(problem, "simplify it, or raise max_vertices")
    if not len(faces):
        remedy = "reconstruct a surface first, or export the faces too"
        raise MeshError(f"{name} has no faces, only {len(vertices):,} points", remedy)
    if uv is not None and not np.isfinite(uv).all():
        _warn(name, "some texture coordinates are NaN or infinite, so all were left out")
        uv = None
    normals = None if corner_normals is None else _of_unit_length(name, corner_normals)
    mesh = Mesh(vertices, faces, uv, name, normals, polygons)
    _check_size(mesh)
    mesh = _drop_unused(_drop_faces(mesh))
    _report_structure(mesh)
    return _normals_checked(mesh)


def _check_size(mesh: Mesh) -> None:
    size = float(np.ptp(mesh.vertices.astype(np.float64), axis=0).max())
    if size and not SMALLEST <= size <= LARGEST:  # without any, all faces are degenerate
        raise MeshError(
            f"{mesh.name} is {size:.2g} units large, beyond what single precision can square",
            f"scale it to between {SMALLEST:g} and {LARGEST:g}",
        )


def _of_unit_length(name: str, normals: np.ndarray) -> np.ndarray | None:
    length = np.linalg.norm(np.asarray(normals, np.float64), axis=-1)
    if not (np.isfinite(length) & (length > 0)).all():
        _warn(name, "some normals are NaN, infinite or zero, so all were left out: edges are shaded smooth")
        return None
    return unit(np.asarray(normals, np.float64))


def _normals_checked(mesh: Mesh) -> Mesh:
    """The mesh without its corner normals if they look away from the faces, or are the smooth ones."""
    if mesh.corner_normals is None:
        return mesh
    away = (dot(mesh.corner_normals, mesh.face_crosses[:, None]) < 0).mean(axis=1)
    share = float((away * mesh.face_areas).sum() / mesh.face_areas.sum())
    if share > OPPOSITE:
        _warn(
            mesh.name,
            f"the normals look away from the faces on {share:.0%} of the area, so all were left out: edges "
            "are shaded smooth; recompute them in a modeller",
        )
        return replace(mesh, corner_normals=None)
    return mesh.with_shading_normals(mesh.corner_normals)


def _drop_faces(mesh: Mesh) -> Mesh:
    flat = degenerate_faces(mesh)
    if flat.all():
        problem = f"all {len(flat):,} faces of {mesh.name} are degenerate: they have no area"
        raise MeshError(problem, "check the scale and the number of digits of the export")
    if flat.any():
        _warn(mesh.name, f"dropped degenerate faces (without area): {flat.sum():,}")
    repeated = _repeated_faces(mesh.faces) & ~flat
    if repeated.any():
        _warn(mesh.name, f"dropped repeated faces: {repeated.sum():,}")
    keep = ~(flat | repeated)
    if keep.all():
        return mesh
    uv, normals = (None if a is None else a[keep] for a in (mesh.uv, mesh.corner_normals))
    polygons = None if mesh.polygons is None else mesh.polygons.without(~keep)
    return Mesh(mesh.vertices, mesh.faces[keep], uv, mesh.name, normals, polygons)


def degenerate_faces(mesh: Mesh) -> np.ndarray:
    """(F,) bool: faces that have no area, or one that is rounding error only."""
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    sides = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    return np.linalg.norm(mesh.face_crosses, axis=1) <= FLAT * sides**2


def _repeated_faces(faces: np.ndarray) -> np.ndarray:
    """(F,) bool: faces whose vertices, in any order, are those of an earlier face."""
    ordered = np.sort(faces, axis=1)
    order = np.lexsort((np.arange(len(faces)), *ordered.T))
    same = (ordered[order][1:] == ordered[order][:-1]).all(axis=1)
    repeated = np.zeros(len(faces), bool)
    repeated[order[1:][same]] = True
    return repeated


def _drop_unused(mesh: Mesh) -> Mesh:
    used = np.zeros(len(mesh.vertices), bool)
    used[mesh.faces] = True
    if used.all():
        return mesh
    _warn(mesh.name, f"dropped vertices without a face: {(~used).sum():,}")
    return replace(mesh, vertices=mesh.vertices[used], faces=(np.cumsum(used) - 1)[mesh.faces])


def _report_structure(mesh: Mesh) -> None:
    _, counts = mesh_edges(mesh.faces, len(mesh.vertices))
    if (counts > 2).any():
        _warn(mesh.name, f"kept edges of more than two faces (non-manifold): {(counts > 2).sum():,}")
    opposed = opposed_edges(mesh.faces, len(mesh.vertices))
    if opposed:
        _warn(
            mesh.name,
            f"kept edges between faces of opposite winding: {opposed:,}; normals may point inwards there, "
            "recompute them in a modeller",
        )
    count = components(mesh.edges)[0]
    if count > 1:
        _warn(mesh.name, f"kept separate components: {count:,}; a pattern does not grow across gaps")


def _warn(name: str, text: str) -> None:
    warnings.warn(f"{name}: {text}", MeshWarning, stacklevel=2)
