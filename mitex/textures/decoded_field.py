"""`decoded_field`: a Mitsuba texture that a small network decodes from states at the vertices of a mesh."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from mitex.errors import ConfigError, MeshError, MitexError
from mitex.mesh import Mesh
from mitex.mesh.gradients import values_and_gradients
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.textures.field import Located
from mitex.textures.interpolation import Corners, linear, smooth
from mitex.textures.local_coordinates import BARYCENTRIC, Waves
from mitex.textures.sine_network import SineNetwork
from mitex.textures.triangle import TrianglePoints, edges, solve, triangle_points
from mitex.textures.variant import for_variant, on_llvm, option, require_variant
from mitex.textures.vertex_rows import VertexRows

INTERPOLATIONS = {"smooth": smooth, "linear": linear}


class DecodedField(VertexRows):
    """value(p) = g(s(p), u(p)): s is interpolated between states at the vertices of a mesh, u are local
    coordinates, g is a sine network (Cells2Pixels, section 3.2). It has detail far below the distance of
    vertices.

    .. pluginparameters::

     * - data
       - |tensor|
       - The states, `mi.TensorXf` of shape (V, C); row i belongs to vertex i of the mesh.
       - exposed, differentiable
     * - vertices
       - |tensor|
       - Positions of the mesh at rest, (V, 3). Distances and directions on the surface are measured on it,
         so the texture stays when the shape in the scene is moved, scaled or bent. The shape has the same
         vertices in the same order.
     * - faces
       - |tensor|
       - Vertex indices of its triangles, (F, 3), in any order.
     * - interpolation
       - |string|
       - How states are interpolated between vertices: `smooth`, which is continuously differentiable across
         edges, or `linear`. (Default: smooth)
     * - coordinates
       - |string|
       - Local coordinates in the order in which the network reads them, after the state: some of `waves`
         (N numbers), `barycentrics` (sorted, 3 numbers) and `polynomials` (2), with spaces between.
         (Default: none)
     * - waves
       - |tensor|
       - (N, 4): for each of N cosines of the position its vector [cycles per edge] and its phase [cycles].
         Needed if `coordinates` names them.
     * - amplitude
       - |float|
       - Amplitude of the waves. (Default: 1)
     * - weight_k
       - |tensor|
       - Matrix of the network's layer k = 0, 1, ..., (outputs, inputs). The outputs of the last layer are the
         channels.
       - exposed, differentiable
     * - bias_k
       - |tensor|
       - What layer k adds, (outputs,). It computes sin(omega (weight x + bias)); the last one has no sine.
       - exposed, differentiable
     * - omega
       - |float|
       - Factor in the sines. (Default: 10)
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
       - If false, `eval`, which BSDFs call for colours, takes values as sRGB in [0, 1], clips them and
         converts them to linear after decoding. If true, it returns them as they are. Nothing else ever
         converts. (Default: false)

    Variants: llvm ones; colours (`eval`) in rgb and mono, the rest in spectral ones, too. Others are a
    ConfigError, and so is rendering a mesh with another number of vertices than `data` has rows. Other shapes
    show `offset`. Points of the shape are found as by `vertex_field`. `mean` and `max` go over the vertices.

    Values are not linear in the data, so nothing but `gather` has their derivatives: by ordinary automatic
    differentiation to states, network, scale and offset. `eval_1_grad` differentiates exactly too, so bumps
    have the normals of the decoded height. Other Mitex code reads all channels: it is a
    `mitex.textures.field.Field`.
    """

    plugin = "decoded_field"

    def __init__(self, props: mi.Properties) -> None:
        require_variant(self.plugin, on_llvm(), "an llvm one")
        self._read(props)
        self.interpolation = option(props, "interpolation", "smooth")
        if self.interpolation not in INTERPOLATIONS:
            raise ConfigError(
                f"decoded_field: 'interpolation' is '{self.interpolation}'",
                f"use {' or '.join(INTERPOLATIONS)}",
            )
        self._read_coordinates(props)
        self._read_network(props)
        self._read_mesh(props)
        self._check()

    def _read_coordinates(self, props: mi.Properties) -> None:
        self.coordinates = option(props, "coordinates", "").split()
        known = ("waves", *BARYCENTRIC)
        if not set(self.coordinates) <= set(known):
            names = " ".join(self.coordinates)
            raise ConfigError(f"decoded_field: 'coordinates' is '{names}'", f"use some of {', '.join(known)}")
        table = np.array(mi.TensorXf(props["waves"])) if "waves" in self.coordinates else np.empty((0, 4))
        if table.ndim != 2 or table.shape[1] != 4:
            raise ConfigError(f"decoded_field: 'waves' has shape {table.shape}", "give one of shape (N, 4)")
        self._waves = Waves(table, option(props, "amplitude", 1.0))

    def _read_network(self, props: mi.Properties) -> None:
        count = sum(key.startswith("weight_") for key in props.keys())  # noqa: SIM118
        weights, biases = (
            [mi.TensorXf(props[f"{kind}_{k}"]) for k in range(count)] for kind in ("weight", "bias")
        )
        try:
            self._network = SineNetwork(weights, biases, option(props, "omega", 10.0))
        except ConfigError as e:
            raise _named(e) from e

    def _read_mesh(self, props: mi.Properties) -> None:
        """What lookups need of the mesh at rest."""
        vertices, faces = (np.array(mi.TensorXf(props[name])) for name in ("vertices", "faces"))
        with np.errstate(invalid="ignore"):
            whole = faces.astype(np.int64)
        try:
            mesh = Mesh(vertices, whole if (whole == faces).all() else faces, name="the mesh at rest")
        except MeshError as e:
            raise _named(e) from e
        self._count = len(mesh.vertices)
        self._vertices = dr.opaque(mi.UInt32, self._count)
        self._positions = upload(mi.Float, mesh.vertices.ravel())
        self._normals = upload(mi.Float, mesh.normals.ravel())
        self._edges = upload(mi.Float, mesh.edge_lengths.astype(np.float32))
        if self.interpolation == "smooth":
            matrix = values_and_gradients(mesh).tocoo()
            self._entry_row, self._entry_column = (
                upload(mi.UInt32, place.astype(np.uint32)) for place in (matrix.row, matrix.col)
            )
            self._entry = upload(mi.Float, matrix.data)

    @property
    def channel_count(self) -> int:
        """Number of outputs of the network."""
        return self._network.outputs

    def traverse(self, callback: mi.TraversalCallback) -> None:
        VertexRows.traverse(self, callback)
        pairs = zip(self._network.weights, self._network.biases, strict=True)
        for k, (weight, bias) in enumerate(pairs):
            callback.put(f"weight_{k}", weight, mi.ParamFlags.Differentiable)
            callback.put(f"bias_{k}", bias, mi.ParamFlags.Differentiable)

    def _check_data(self) -> None:
        if self.data.ndim != 2 or self.data.shape[0] != self._count or self.data.shape[1] == 0:
            raise ConfigError(
                f"decoded_field: 'data' has shape {self.data.shape}", f"give one of shape ({self._count}, C)"
            )
        try:
            self._network.check()
        except ConfigError as e:
            raise _named(e) from e
        own = {"waves": len(self._waves.table)} | {name: count for name, (count, _) in BARYCENTRIC.items()}
        inputs = self.data.shape[1] + sum(own[name] for name in self.coordinates)
        count = self._network.inputs
        if count != inputs:
            raise ConfigError(
                f"decoded_field: 'weight_0' has {count} inputs, but state and coordinates are {inputs}",
                "give the network as many inputs",
            )
        self._table = self._rows_to_read()
        dr.eval(self._table)

    def _rows_to_read(self) -> mi.Float:
        """The rows that the interpolation reads, flat: the states, or the states and their gradients."""
        if self.interpolation == "linear":
            return self.data.array
        width = self.data.shape[1]
        place = dr.arange(mi.UInt32, dr.width(self._entry) * width)
        entry, channel = place // width, place % width
        row, column = (dr.gather(mi.UInt32, i, entry) for i in (self._entry_row, self._entry_column))
        value = dr.gather(mi.Float, self._entry, entry)
        value *= dr.gather(mi.Float, self.data.array, column * width + channel)
        table = dr.zeros(mi.Float, 4 * self.data.shape[0] * width)
        dr.scatter_add(table, value, row * width + channel)
        return table

    def _rows(self) -> mi.UInt32:
        return dr.arange(mi.UInt32, self._count)

    def locate(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> Located:
        """Rows, weights and local coordinates of the points `si`, and which have any."""
        return self._at(*triangle_points(si, self._vertices, active))

    def _at(self, index: Sequence[mi.UInt32], barycentric: Sequence[mi.Float], active: mi.Bool) -> Located:
        position = [dr.gather(mi.Point3f, self._positions, i, active) for i in index]
        normal = [dr.gather(mi.Normal3f, self._normals, i, active) for i in index]
        rows, weights = INTERPOLATIONS[self.interpolation](Corners(index, position, normal), barycentric)
        coordinates: list[mi.Float] = []
        for name in self.coordinates:
            if name == "waves":
                edge = _mix(barycentric, [dr.gather(mi.Float, self._edges, i, active) for i in index])
                # No number may be infinite, even where nothing is read: its gradient would not be 0.
                coordinates += self._waves(_mix(barycentric, position), dr.select(active, edge, 1))
            else:
                coordinates += BARYCENTRIC[name][1](barycentric)
        return Located(tuple(rows), tuple(weights), active, tuple(coordinates))

    def _at_rows(self) -> Located:
        index = self._rows()
        return self._at((index, index, index), (mi.Float(1), mi.Float(0), mi.Float(0)), mi.Bool(True))

    def gather(self, located: Located, channels: range | None = None) -> list[mi.Float]:
        """Decoded `scale * value + offset` of the channels (default: all), one Float each."""
        values = self._network(_inputs(located, self._states(located)))
        return [
            dr.fma(dr.select(located.active, values[c], 0), self.scale, self.offset)
            for c in (range(self.channel_count) if channels is None else channels)
        ]

    def _states(self, located: Located) -> list[list[mi.Float]]:
        """What the lookups read: for each channel of the state, K values."""
        width = self.data.shape[1]
        return [
            [dr.gather(mi.Float, self._table, width * row + c, located.active) for row in located.rows]
            for c in range(width)
        ]

    def eval_1_grad(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> mi.Vector2f:
        """Derivatives along `si.dp_du` and `si.dp_dv`."""
        self._lookup(si, active)
        points = triangle_points(si, self._vertices, active)
        _, e1, e2 = edges(mi.MeshPtr(si.shape), points.index, points.active)
        located = self._at(*points)
        rows = self._states(located)
        tangents = []
        for way in (si.dp_du, si.dp_dv):
            a, b = solve(e1, e2, way)
            change = self._change(points, (-a - b, a, b))
            tangents.append(_inputs(change, rows))
        slopes = self._network.slopes(_inputs(located, rows), tangents)
        along = [dr.select(points.active, slope[self.channel], 0) for slope in slopes]
        return self.scale * mi.Vector2f(*along)

    def _change(self, points: TrianglePoints, way: Sequence[mi.Float]) -> Located:
        """The derivatives of weights and coordinates where the barycentric weights change along `way`."""
        with dr.resume_grad():
            t = mi.Float(0)
            dr.enable_grad(t)
            pairs = zip(points.barycentric, way, strict=True)
            moved = [dr.detach(b) + t * dr.detach(w) for b, w in pairs]
            located = self._at(points.index, moved, points.active)
            dr.forward(t, dr.ADFlag.ClearEdges)  # weights may be what coordinates are made of: they stay
            change = dr.grad((located.weights, located.coordinates))
        return located._replace(weights=change[0], coordinates=change[1])

    def to_string(self) -> str:
        own = {"vertices": self._count, "states": self.data.shape[1], "channels": self.channel_count}
        names = " ".join(self.coordinates)
        return self._description("DecodedField", **own, interpolation=self.interpolation, coordinates=names)


def _inputs(located: Located, rows: Sequence[Sequence[mi.Float]]) -> list[mi.Float]:
    """What the network reads: the interpolated state, of K values for each channel, and local coordinates."""
    return [*(_mix(located.weights, values) for values in rows), *located.coordinates]


def _mix(weights: Sequence[mi.Float], values: Sequence[Any]) -> Any:
    return sum(w * v for w, v in zip(weights, values, strict=True))


def _named(error: MitexError) -> ConfigError:
    """The same error, which says that it is of this plugin."""
    return ConfigError(f"decoded_field: {error.problem}", error.remedy)


def register() -> None:
    """Registers the texture for the current variant."""
    cls = for_variant(mi.Texture, DecodedField)
    mi.register_texture("decoded_field", lambda props: cls(props))
