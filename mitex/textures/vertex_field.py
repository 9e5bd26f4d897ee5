"""`vertex_field`: a Mitsuba texture that carries any number of channels per mesh vertex."""

from __future__ import annotations

from collections.abc import Iterable

from mitex.runtime.jit import dr, mi
from mitex.textures.field import FieldMethods, Located
from mitex.textures.variant import for_variant


class VertexFieldMethods(FieldMethods):
    """Values at the vertices of a mesh, interpolated linearly over each triangle.

    .. pluginparameters::

     * - data
       - |tensor|
       - `mi.TensorXf` of shape (V, C), or (V,) for one channel; row i belongs to vertex i of the mesh.
       - exposed, differentiable
     * - channel
       - |int|
       - First channel that the texture shows to a BSDF: `eval` and `eval_3` read three channels from here on
         (or repeat this one when fewer than three are left), `eval_1` and `eval_1_grad` read this one.
         (Default: 0)
     * - scale, offset
       - |float|
       - Every value is `scale * data + offset`. (Default: 1 and 0)
       - exposed, differentiable
     * - raw
       - |bool|
       - If false, values are sRGB in [0, 1], and `eval`, which BSDFs call for colours, clips them and
         converts them to linear after interpolation. If true, `eval` returns them as they are. `eval_1` and
         `eval_3` (roughness, normal maps, bump maps) and the `feature` integrator never convert. (Default:
         false)

    The texture works on triangle meshes of JIT variants, with one instance per mesh; on another shape, or
    where a triangle refers to a vertex beyond the data, it is `offset`. `eval` needs an rgb or mono variant.

    Barycentric weights: a mesh without UVs gives them exactly in `si.uv`. With UVs they are solved from
    `si.p` in the triangle, the way Mitsuba evaluates its own mesh attributes: `si.uv` cannot be inverted
    where the UV map folds or is degenerate, and mesh attributes themselves hold only 1 or 3 channels. `si.p`
    is in world space, so a mesh with UVs must not be placed through an `instance`.

    Other Mitex code reads all channels: it is a `mitex.textures.field.Field`.
    """

    plugin = "vertex_field"

    def __init__(self, props: mi.Properties) -> None:
        self._read(props)
        if self.data.ndim == 1:
            self.data = mi.TensorXf(self.data.array, (self.data.shape[0], 1))
        self._check()

    def _check_data(self) -> None:
        if self.data.ndim != 2 or 0 in self.data.shape:
            raise RuntimeError(f"vertex_field: 'data' has shape {self.data.shape}; give one of shape (V, C)")

    def _rows(self) -> mi.UInt32:
        return dr.arange(mi.UInt32, self.data.shape[0])

    def locate(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> Located:
        """Vertices (3 indices) and barycentric weights (3) of the points `si`, and which have any."""
        mesh = mi.MeshPtr(si.shape)
        active = mi.Bool(active) & si.shape.is_mesh()
        index = mesh.face_indices(si.prim_index, active)
        active &= dr.max(index) < self.data.shape[0]
        p0, e1, e2 = _edges(mesh, index, active)
        offset = mi.Vector3f(si.p - p0)
        d1, d2 = dr.dot(e1, offset), dr.dot(e2, offset)
        u, v = _solve(e1, e2, d1, d2)
        has_uv = mesh.has_vertex_texcoords()
        u, v = dr.select(has_uv, u, si.uv.x), dr.select(has_uv, v, si.uv.y)
        return Located(tuple(index), (1 - u - v, u, v), active)

    def eval_1_grad(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> mi.Vector2f:
        """Derivatives along `si.dp_du` and `si.dp_dv`: the interpolant's surface gradient, projected on each.

        On a mesh without UVs those two are an orthonormal frame and `si.uv` has other units, so differences
        of vertex values over `si.uv` would be wrong.
        """
        located = self.locate(si, active)
        index, _, active = located
        _, e1, e2 = _edges(mi.MeshPtr(si.shape), index, active)
        corner = self._row_values(located, self.channel)
        a, b = _solve(e1, e2, corner[1] - corner[0], corner[2] - corner[0])
        gradient = self.scale * dr.select(active, a * e1 + b * e2, 0)
        return mi.Vector2f(dr.dot(gradient, si.dp_du), dr.dot(gradient, si.dp_dv))

    def to_string(self) -> str:
        return self._description("VertexField", vertices=self.data.shape[0], channels=self.channel_count)


def _edges(
    mesh: mi.MeshPtr, index: Iterable[mi.UInt32], active: mi.Bool
) -> tuple[mi.Point3f, mi.Vector3f, mi.Vector3f]:
    """First corner of each triangle and the edges from it to the second and third."""
    p0, p1, p2 = (mesh.vertex_position(i, active) for i in index)
    return p0, mi.Vector3f(p1 - p0), mi.Vector3f(p2 - p0)


def _solve(e1: mi.Vector3f, e2: mi.Vector3f, d1: mi.Float, d2: mi.Float) -> tuple[mi.Float, mi.Float]:
    """The a, b for which the tangent vector a e1 + b e2 has the dot products d1 with e1 and d2 with e2."""
    a11, a12, a22 = dr.dot(e1, e1), dr.dot(e1, e2), dr.dot(e2, e2)
    determinant = dr.fma(a11, a22, -a12 * a12)
    inverse = dr.select(determinant > 0, 1 / determinant, 0)
    return (a22 * d1 - a12 * d2) * inverse, (a11 * d2 - a12 * d1) * inverse


def register() -> None:
    """Registers the texture for the current variant."""
    cls = for_variant("VertexField", mi.Texture, VertexFieldMethods)
    mi.register_texture("vertex_field", lambda props: cls(props))
