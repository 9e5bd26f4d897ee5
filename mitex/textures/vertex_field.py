"""`vertex_field`: a Mitsuba texture that carries any number of channels per mesh vertex."""

from __future__ import annotations

from mitex.errors import ConfigError
from mitex.runtime.jit import dr, mi
from mitex.textures.field import Located
from mitex.textures.triangle import combine, edges, triangle_points
from mitex.textures.variant import for_variant
from mitex.textures.vertex_rows import VertexRows


class VertexField(VertexRows):
    """Values at the vertices of a mesh, interpolated linearly over each triangle.

    .. pluginparameters::

     * - data
       - |tensor|
       - The values, `mi.TensorXf` of shape (V, C), or (V,) for one channel; row i belongs to vertex i of the
         mesh.
       - exposed, differentiable
     * - channel
       - |int|
       - First channel that the texture shows to a BSDF: `eval` and `eval_3` read three channels from here on
         (or repeat this one when fewer than three are left), `eval_1` and `eval_1_grad` read this one.
         (Default: 0)
     * - scale
       - |float|
       - Factor of every value. (Default: 1)
       - exposed, differentiable
     * - offset
       - |float|
       - Added to every value, after `scale`. (Default: 0)
       - exposed, differentiable
     * - raw
       - |bool|
       - If false, values are sRGB in [0, 1], and `eval`, which BSDFs call for colours, clips them and
         converts them to linear after interpolation. If true, `eval` returns them as they are. `eval_1` and
         `eval_3` (roughness, normal maps, bump maps) and the `feature` integrator never convert. (Default:
         false)

    Variants: llvm and cuda ones; colours (`eval`) in rgb and mono, the rest in spectral ones, too. Others are
    a ConfigError.

    It is put on triangle meshes, with one instance per mesh; other shapes show `offset`. Rendering a mesh
    with another number of vertices than `data` has rows is a ConfigError.

    Barycentric weights: a mesh without UVs gives them exactly, in `si.uv`; with UVs they are solved from
    `si.p`, which is in world space, so such a mesh must not be placed through an `instance`.

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
            raise ConfigError(f"vertex_field: 'data' has shape {self.data.shape}", "give one of shape (V, C)")
        self._vertices = dr.opaque(mi.UInt32, self.data.shape[0])

    def _rows(self) -> mi.UInt32:
        return dr.arange(mi.UInt32, self.data.shape[0])

    def locate(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> Located:
        """Vertices (3 indices) and barycentric weights (3) of the points `si`, and which have any."""
        return Located(*triangle_points(si, self._vertices, active))

    def eval_1_grad(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> mi.Vector2f:
        """Derivatives along `si.dp_du` and `si.dp_dv`: the interpolant's surface gradient, projected on each.

        On a mesh without UVs those two are an orthonormal frame and `si.uv` has other units, so differences
        of vertex values over `si.uv` would be wrong.
        """
        located = self._lookup(si, active)
        _, e1, e2 = edges(mi.MeshPtr(si.shape), located.rows, located.active)
        corner = self._row_values(located, self.channel)
        a, b = combine(e1, e2, corner[1] - corner[0], corner[2] - corner[0])
        gradient = self.scale * dr.select(located.active, a * e1 + b * e2, 0)
        return mi.Vector2f(dr.dot(gradient, si.dp_du), dr.dot(gradient, si.dp_dv))

    def to_string(self) -> str:
        return self._description("VertexField", vertices=self.data.shape[0], channels=self.channel_count)


def register() -> None:
    """Registers the texture for the current variant."""
    cls = for_variant(mi.Texture, VertexField)
    mi.register_texture("vertex_field", lambda props: cls(props))
