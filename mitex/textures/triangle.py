"""The triangle of a Mitsuba mesh that a surface point lies on."""

from __future__ import annotations

from collections.abc import Iterable
from typing import NamedTuple

from mitex.runtime.jit import dr, mi


class TrianglePoints(NamedTuple):
    """Points on a mesh.

    Attributes:
        index: of the three corners.
        barycentric: weights of the three corners.
        active: which points lie on a mesh that has these corners.
    """

    index: tuple[mi.UInt32, ...]
    barycentric: tuple[mi.Float, ...]
    active: mi.Bool


def triangle_points(
    si: mi.SurfaceInteraction3f, vertices: mi.UInt32, active: mi.Bool | bool = True
) -> TrianglePoints:
    """Corners and barycentric weights of the points `si`, active on meshes with corners below `vertices`.

    That number is opaque, `dr.opaque`: as a literal, each would ask for a kernel of its own.
    A mesh without UVs gives the weights exactly in `si.uv`. With UVs they are solved from `si.p` in the
    triangle, the way Mitsuba evaluates its own mesh attributes: `si.uv` cannot be inverted where the UV map
    folds or is degenerate. `si.p` is in world space, so a mesh with UVs must not be placed through an
    `instance`.
    """
    mesh = mi.MeshPtr(si.shape)
    active = mi.Bool(active) & si.shape.is_mesh()
    index = mesh.face_indices(si.prim_index, active)
    active &= dr.max(index) < vertices
    p0, e1, e2 = edges(mesh, index, active)
    offset = mi.Vector3f(si.p - p0)
    u, v = solve(e1, e2, offset)
    has_uv = mesh.has_vertex_texcoords()
    u, v = dr.select(has_uv, u, si.uv.x), dr.select(has_uv, v, si.uv.y)
    return TrianglePoints(tuple(index), (1 - u - v, u, v), active)


def edges(
    mesh: mi.MeshPtr, index: Iterable[mi.UInt32], active: mi.Bool
) -> tuple[mi.Point3f, mi.Vector3f, mi.Vector3f]:
    """First corner of each triangle and the edges from it to the second and third."""
    p0, p1, p2 = (mesh.vertex_position(i, active) for i in index)
    return p0, mi.Vector3f(p1 - p0), mi.Vector3f(p2 - p0)


def solve(e1: mi.Vector3f, e2: mi.Vector3f, way: mi.Vector3f) -> tuple[mi.Float, mi.Float]:
    """The a, b for which a e1 + b e2 is the part of `way` in the triangle's plane."""
    return combine(e1, e2, dr.dot(e1, way), dr.dot(e2, way))


def combine(e1: mi.Vector3f, e2: mi.Vector3f, d1: mi.Float, d2: mi.Float) -> tuple[mi.Float, mi.Float]:
    """The a, b for which the tangent vector a e1 + b e2 has the dot products d1 with e1 and d2 with e2."""
    a11, a12, a22 = dr.dot(e1, e1), dr.dot(e1, e2), dr.dot(e2, e2)
    determinant = dr.fma(a11, a22, -a12 * a12)
    inverse = dr.select(determinant > 0, 1 / determinant, 0)
    return (a22 * d1 - a12 * d2) * inverse, (a11 * d2 - a12 * d1) * inverse
