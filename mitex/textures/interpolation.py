"""Values at the vertices of a mesh, interpolated over its triangles: linearly, or smoothly across edges.

The smooth interpolant is Nielson's side-vertex method (1979): along the line from a corner through the point
to the opposite side runs the cubic of the values and slopes at both ends, and the three cubics are blended so
that near a side only the one that starts there counts. A side's values and slopes depend on what its two
vertices hold alone, so that both faces agree on them: in the plane of the faces, unfolded, the interpolant is
continuously differentiable. It reproduces quadratic polynomials.

Both are linear in the values: a point reads rows of a table with weights. Linear interpolation has three
rows, those of its corners. The smooth one has twelve: row 4 v + k of the table that `mesh.gradients` makes
holds the values of vertex v for k = 0, and their derivatives by x, y, z for k = 1, 2, 3.
"""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Literal, NamedTuple, cast

import numpy as np

from mitex.mesh import Mesh
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import tensor_with_room, upload

if TYPE_CHECKING:
    import torch

    from mitex.sparse import Weights

Kind = Literal["linear", "smooth"]


class Corners(NamedTuple):
    """The three corners of the triangles that points lie on.

    Attributes:
        index: of the vertices.
        position: of the vertices [mesh units].
        normal: of the vertices, unit.
    """

    index: Sequence[mi.UInt32]
    position: Sequence[mi.Point3f]
    normal: Sequence[mi.Normal3f]


def linear(corners: Corners, barycentric: Sequence[mi.Float]) -> tuple[list[mi.UInt32], list[mi.Float]]:
    """Rows and weights of the piecewise linear interpolant."""
    return list(corners.index), list(barycentric)


def smooth(corners: Corners, barycentric: Sequence[mi.Float]) -> tuple[list[mi.UInt32], list[mi.Float]]:
    """Rows and weights of the smooth interpolant in the table of `mesh.gradients`."""
    value = [mi.Float(0), mi.Float(0), mi.Float(0)]
    slope = [mi.Vector3f(0), mi.Vector3f(0), mi.Vector3f(0)]
    for k, share in enumerate(_shares(barycentric)):
        _add_side(corners, barycentric, k, share, value, slope)
    rows, weights = [], []
    for index, own, gradient in zip(corners.index, value, slope, strict=True):
        rows += [4 * index + term for term in range(4)]
        weights += [own, gradient.x, gradient.y, gradient.z]
    return rows, weights


def _shares(barycentric: Sequence[mi.Float]) -> list[mi.Float]:
    """What the cubic that ends on each side counts: 1 on its side, 0 on the others, both with slope 0."""
    squares = [b * b for b in barycentric]
    products = [squares[k - 2] * squares[k - 1] for k in range(3)]
    total = products[0] + products[1] + products[2]
    # At a corner, and nearer to it than squares of squares can tell, all three are the corner's value.
    known = total > 1e-30
    inverse = dr.rcp(dr.maximum(total, 1e-30))
    return [dr.select(known, product * inverse, 1 / 3) for product in products]


def _add_side(
    corners: Corners,
    barycentric: Sequence[mi.Float],
    k: int,
    share: mi.Float,
    value: list[mi.Float],
    slope: list[mi.Vector3f],
) -> None:
    """Adds `share` times the cubic between corner k and the side opposite to weights of values and slopes."""
    i, j = (k + 1) % 3, (k + 2) % 3
    p, q, apex = corners.position[i], corners.position[j], corners.position[k]
    edge = mi.Vector3f(q - p)
    length2 = dr.maximum(dr.squared_norm(edge), 1e-30)
    across = dr.cross(mi.Vector3f(corners.normal[i] + corners.normal[j]), edge)
    across *= dr.rsqrt(dr.maximum(dr.squared_norm(across), 1e-30))
    both = barycentric[i] + barycentric[j]
    t = dr.select(both > 0, barycentric[j] / dr.maximum(both, 1e-30), 0.5)
    # On the side: Hermite's cubic between its ends, the slope across it linear.
    (h0, d0, h1, d1), (g0, e0, g1, e1) = _hermite(t), _hermite_slopes(t)
    radial = mi.Vector3f(apex - p) - t * edge
    # The way to the corner in the plane of the face, split along the side and across it.
    ahead = dr.dot(radial, edge) / length2
    height = dr.safe_sqrt(dr.squared_norm(radial) - ahead * ahead * length2)
    a0, b0, a1, b1 = (share * h for h in _hermite(barycentric[k]))
    value[i] += a0 * h0 + b0 * ahead * g0
    value[j] += a0 * h1 + b0 * ahead * g1
    slope[i] += (a0 * d0 + b0 * ahead * e0) * edge + (b0 * height * (1 - t)) * across
    slope[j] += (a0 * d1 + b0 * ahead * e1) * edge + (b0 * height * t) * across
    value[k] += a1
    slope[k] += b1 * radial


def _hermite(t: mi.Float) -> tuple[mi.Float, ...]:
    """Hermite's cubics of the first value and slope, and of the last value and slope."""
    t2 = t * t
    t3 = t2 * t
    return 2 * t3 - 3 * t2 + 1, t3 - 2 * t2 + t, 3 * t2 - 2 * t3, t3 - t2


def _hermite_slopes(t: mi.Float) -> tuple[mi.Float, ...]:
    """Their derivatives."""
    t2 = t * t
    return 6 * (t2 - t), 3 * t2 - 4 * t + 1, 6 * (t - t2), 3 * t2 - 2 * t


class SurfaceLookup:
    """Reads tables of vertex values at points of a mesh.

    Args:
        mesh: the mesh.
        kind: "linear" or "smooth".
    """

    def __init__(self, mesh: Mesh, kind: Kind = "smooth") -> None:
        self.mesh, self.kind = mesh, kind
        self._weigh = {"linear": linear, "smooth": smooth}[kind]
        self._faces = upload(mi.UInt32, mesh.faces.astype(np.uint32).ravel())
        self._positions = upload(mi.Float, mesh.vertices.ravel())
        self._normals = upload(mi.Float, mesh.normals.ravel())

    def weights(self, face: torch.Tensor, barycentric: torch.Tensor) -> Weights:
        """What the points on `face` (P,) int32 at `barycentric` (P, 3) float32 read."""
        import torch

        from mitex.sparse import Weights

        columns = len(self.mesh.vertices) * (4 if self.kind == "smooth" else 1)
        if not len(face):  # Dr.Jit has no arithmetic on empty arrays
            width = 12 if self.kind == "smooth" else 3
            return Weights(face.new_empty(0, width), barycentric.new_empty(0, width), columns)
        b = [mi.Float(tensor_with_room(barycentric[:, k])) for k in range(3)]
        triangle = 3 * mi.UInt32(tensor_with_room(face.to(torch.int32)))
        index = [dr.gather(mi.UInt32, self._faces, triangle + k) for k in range(3)]
        position = [dr.gather(mi.Point3f, self._positions, i) for i in index]
        normal = [dr.gather(mi.Normal3f, self._normals, i) for i in index]
        rows, weights = self._weigh(Corners(index, position, normal), b)
        rows = [mi.Int32(row) for row in rows]
        dr.eval(rows, weights)
        index, weight = (torch.stack([cast(torch.Tensor, x.torch()) for x in v], 1) for v in (rows, weights))
        return Weights(index, weight, columns)
