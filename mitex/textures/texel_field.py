"""`texel_field`: a Mitsuba texture of any number of channels on UV texels, filtered within charts."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple

from mitex.errors import ConfigError
from mitex.runtime.jit import dr, mi
from mitex.textures.field import FieldMethods, Located
from mitex.textures.variant import for_variant, option

FILTERS = ("bilinear", "nearest")
MAX_CHART = 2.0**24  # beyond, float32 skips integers
INSET = 1e-6  # [texel] see `_Footprint.around`


class TexelField(FieldMethods):
    """Values on the texels of a UV layout, filtered within charts.

    .. pluginparameters::

     * - data
       - |tensor|
       - The values, `mi.TensorXf` of shape (H, W, C), finite. Row 0 is the top of the map, see below.
       - exposed, differentiable
     * - charts
       - |tensor|
       - `mi.TensorXf` of shape (H, W): the number of the chart that a texel belongs to (an integer from 0 on,
         a chart's padding included), or -1 where it is unused. (Default: one chart everywhere)
       - exposed
     * - filter
       - |string|
       - How texels are interpolated: `bilinear` or `nearest`. (Default: bilinear)
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
         converts them to linear after interpolation. If true, it returns them as they are. Nothing else ever
         converts. (Default: false)

    Texel (r, c) shows u = (c + 0.5) / W, v = 1 - (r + 0.5) / H, with v upwards as in `mitex.atlas.Atlas` and
    in OBJ files. Mitsuba's own `bitmap` shows its row 0 at v = 0 instead, and to make up for it the `obj`
    loader turns v around: give that `flip_tex_coords=False`. Lookups use `si.uv`, on any shape that has UVs;
    outside [0, 1] they repeat the border.

    A bilinear lookup reads the four texels around the point. The nearest of them that is used decides on the
    chart; texels of other charts and unused ones get weight 0 and the rest is renormalised. Where all four
    are unused, the texture is `offset`. So no value crosses over if the nearest used texel belongs to the
    point's own chart; charts that are at least 1.5 texels apart, with padding between them or without, ensure
    it (1 texel if their borders run along the axes).

    Variants: as `vertex_field`.

    Gradients flow to `data` with the transposed weights, and to `si.uv` where it is attached. Other Mitex
    code reads all channels: it is a `mitex.textures.field.Field`. `mean` and `max` go over the used texels.
    """

    plugin = "texel_field"

    def __init__(self, props: mi.Properties) -> None:
        self._read(props)
        self.charts = mi.TensorXf(props["charts"]) if "charts" in props else None
        self.filter = option(props, "filter", "bilinear")
        if self.filter not in FILTERS:
            raise ConfigError(f"texel_field: 'filter' is '{self.filter}'", f"use {' or '.join(FILTERS)}")
        self._chart = self._charts()
        self._check()
        if not dr.all(dr.isfinite(self.data.array)):
            raise ConfigError(
                "texel_field: 'data' has values that are not finite", "unused texels may hold 0"
            )

    def traverse(self, callback: mi.TraversalCallback) -> None:
        FieldMethods.traverse(self, callback)
        if self.charts is not None:
            callback.put("charts", self.charts, mi.ParamFlags.NonDifferentiable)

    def parameters_changed(self, keys: Sequence[str] = ()) -> None:
        if not keys or "charts" in keys:  # not for every step of an optimization
            self._chart = self._charts()
        self._check()

    def _check_data(self) -> None:
        shape = self.data.shape
        if len(shape) != 3 or 0 in shape:
            raise ConfigError(f"texel_field: 'data' has shape {shape}", "give one of shape (H, W, C)")
        # Opaque: as literals, each size would ask for a kernel of its own.
        self._height, self._width = (dr.opaque(mi.UInt32, size) for size in shape[:2])
        if self.charts is not None and self.charts.shape != shape[:2]:
            raise ConfigError(
                f"texel_field: 'charts' has shape {self.charts.shape}",
                f"give {shape[:2]}, one number per texel",
            )

    def _charts(self) -> mi.Int32 | None:
        """The chart numbers as flat Int32, or None."""
        if self.charts is None:
            return None
        number = dr.detach(self.charts.array)
        if not dr.all((number >= -1) & (number < MAX_CHART) & (number == dr.round(number))):
            raise ConfigError(
                "texel_field: 'charts' holds numbers that are no integers from 0 on, or -1",
                "number the charts from 0 on, and give unused texels -1",
            )
        if not dr.any(number >= 0):
            raise ConfigError(
                "texel_field: 'charts' is -1 everywhere, so no texel is used", "number the charts from 0 on"
            )
        chart = mi.Int32(number)
        dr.eval(chart)
        return chart

    def _rows(self) -> mi.UInt32:
        if self._chart is None:
            return dr.arange(mi.UInt32, self.data.shape[0] * self.data.shape[1])
        return mi.UInt32(dr.compress(self._chart >= 0))

    def locate(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> Located:
        """Texels (flat indices) and weights of the points `si`: four each, or one if nearest."""
        footprint = self._footprint(si, active)
        if self.filter == "nearest":
            return Located((footprint.nearest,), (mi.Float(1),), footprint.active)
        return self._located(footprint)

    def eval_1_grad(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> mi.Vector2f:
        """Derivatives by u and v of the interpolant; 0 for the nearest texel."""
        if self.filter == "nearest":
            return mi.Vector2f(0)
        footprint = self._footprint(si, active)
        located = self._located(footprint)
        values = self._row_values(located, self.channel)
        # (N / D)' = (N' - (N / D) D') / D for the weighted sum N and the sum of weights D.
        mean = sum(w * v for w, v in zip(located.weights, values, strict=True))
        slopes = [
            sum(w * (v - mean) for w, v in zip(footprint.normalised(slope), values, strict=True))
            for slope in footprint.slopes
        ]
        slope = mi.Vector2f(mi.Float(self._width) * slopes[0], -mi.Float(self._height) * slopes[1])
        return self.scale * dr.select(footprint.active, slope, 0)

    def to_string(self) -> str:
        height, width = self.data.shape[:2]
        own = {"resolution": f"[{width}, {height}]", "channels": self.channel_count, "filter": self.filter}
        return self._description("TexelField", **own, masked=str(self.charts is not None).lower())

    def resolution(self) -> mi.ScalarVector2i:
        return mi.ScalarVector2i(self.data.shape[1], self.data.shape[0])

    def _located(self, footprint: _Footprint) -> Located:
        return Located(footprint.texels, footprint.normalised(footprint.weights), footprint.active)

    def _footprint(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool) -> _Footprint:
        return _Footprint.around(si.uv, self._width, self._height, self._chart, mi.Bool(active))


class _Footprint(NamedTuple):
    """The four texels around each point, those of its chart told from the others.

    Attributes:
        texels: flat indices; that of the nearest instead of a texel that does not count. So a value that is
            not finite stays on its own chart, which a weight of 0 alone would not ensure.
        counts: whether each of the four counts.
        weights: bilinear weights of all four.
        slopes: their derivatives along columns and rows [1 / texel].
        nearest: flat index of the nearest used texel.
        active: where there is one.
    """

    texels: tuple[mi.UInt32, ...]
    counts: tuple[mi.Bool, ...]
    weights: tuple[mi.Float, ...]
    slopes: tuple[tuple[mi.Float, ...], tuple[mi.Float, ...]]
    nearest: mi.UInt32
    active: mi.Bool

    @staticmethod
    def around(
        uv: mi.Point2f, width: mi.UInt32, height: mi.UInt32, chart: mi.Int32 | None, active: mi.Bool
    ) -> _Footprint:
        """The footprints of the points `uv`; `chart` has one number per texel or is None."""
        (c0, c1, a), (r0, r1, b) = _between(uv.x, width), _between(1 - uv.y, height)
        if chart is not None:
            # No weight is ever quite 0: whichever texels count, there is something to renormalise.
            a, b = dr.clip(a, INSET, 1 - INSET), dr.clip(b, INSET, 1 - INSET)
        texels = tuple(row * width + column for row in (r0, r1) for column in (c0, c1))
        pairs = [(wy, wx) for wy in (1 - b, b) for wx in (1 - a, a)]
        if chart is None:
            charts = [mi.Int32(0)] * 4
        else:
            charts = [dr.gather(mi.Int32, chart, texel, active) for texel in texels]
        nearest, own, largest = mi.UInt32(0), mi.Int32(-1), mi.Float(0)
        for (wy, wx), texel, number in zip(pairs, texels, charts, strict=True):
            # Within a square of texels, a larger bilinear weight is a smaller distance.
            closer = (number >= 0) & (wy * wx > largest)
            nearest, own = dr.select(closer, texel, nearest), dr.select(closer, number, own)
            largest = dr.select(closer, wy * wx, largest)
        counts = tuple(number == own for number in charts)
        return _Footprint(
            texels=tuple(dr.select(c, t, nearest) for c, t in zip(counts, texels, strict=True)),
            counts=counts,
            weights=tuple(wy * wx for wy, wx in pairs),
            slopes=((b - 1, 1 - b, -b, b), (a - 1, -a, 1 - a, a)),
            nearest=nearest,
            active=active & (own >= 0),
        )

    def normalised(self, values: tuple[mi.Float, ...]) -> tuple[mi.Float, ...]:
        """Four values over the sum of the weights that count, 0 for texels that do not."""
        total = sum(dr.select(c, w, 0) for c, w in zip(self.counts, self.weights, strict=True))
        return tuple(dr.select(c, v / total, 0) for c, v in zip(self.counts, values, strict=True))


def _between(t: mi.Float, size: mi.UInt32) -> tuple[mi.UInt32, mi.UInt32, mi.Float]:
    """The two of `size` texels on both sides of t in [0, 1], and how far t is from the first [texel]."""
    position = dr.clip(t, 0, 1) * mi.Float(size) - 0.5
    below = dr.floor(position)
    first = mi.Int32(below)
    # Clipped as integers, since a NaN passes through the other clip; at a border both are the same texel.
    low, high = (mi.UInt32(dr.clip(i, 0, mi.Int32(size) - 1)) for i in (first, first + 1))
    return low, high, position - below


def register() -> None:
    """Registers the texture for the current variant."""
    cls = for_variant(mi.Texture, TexelField)
    mi.register_texture("texel_field", lambda props: cls(props))
