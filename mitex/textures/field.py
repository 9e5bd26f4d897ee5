"""What the fields of Mitex share: textures that carry any number of channels on a surface."""

from __future__ import annotations

from collections.abc import Sequence
from typing import NamedTuple, Protocol, runtime_checkable

from mitex.errors import ConfigError
from mitex.runtime.jit import dr, mi
from mitex.textures.variant import init_base, option, require_variant


class Located(NamedTuple):
    """Where lookups read.

    Attributes:
        rows: of the data, K of them.
        weights: of the rows.
        active: which of the lookups read any.
        coordinates: what else a field that decodes its data knows of the points.
    """

    rows: tuple[mi.UInt32, ...]
    weights: tuple[mi.Float, ...]
    active: mi.Bool
    coordinates: tuple[mi.Float, ...] = ()


@runtime_checkable
class Field(Protocol):
    """A texture of which all channels can be read, in two steps.

    `isinstance(texture, Field)` tells it from Mitsuba's own textures. `locate` may be detached: it depends on
    the geometry alone, and `gather` carries all derivatives by the data and other parameters. Where `gather`
    only sums rows, it is linear in the data, and its adjoint a scatter with the weights.
    """

    def locate(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> Located:
        """Where the points `si` read."""
        ...

    def gather(self, located: Located, channels: range | None = None) -> list[mi.Float]:
        """Values times `scale` plus `offset` of the channels (default: all), one Float each."""
        ...

    def check_shape(self, shape: mi.Shape) -> None:
        """Raises a ConfigError if the field cannot be put on a shape."""
        ...


class FieldMethods:
    """Members of a field's plugin class; a subclass adds `locate`, `eval_1_grad`, `_check_data` and `_rows`.

    Mitsuba calls `eval` and its like, which check first whether the field fits the shapes that show it.

    `data` is a tensor whose last axis are the C channels; all others together are its rows, in memory order.
    """

    plugin: str  # type of the plugin, for messages
    data: mi.TensorXf

    def _read(self, props: mi.Properties) -> None:
        """Reads the properties that all fields have."""
        require_variant(self.plugin, dr.is_jit_v(mi.Float), "an llvm or cuda one")
        init_base(mi.Texture, self, props)
        self.data = mi.TensorXf(props["data"])
        self.channel = option(props, "channel", 0)
        self.scale = mi.Float(props.get("scale", 1.0))
        self.offset = mi.Float(props.get("offset", 0.0))
        self.raw = option(props, "raw", False)

    @property
    def channel_count(self) -> int:
        """C, the number of channels of the data."""
        return self.data.shape[-1]

    def traverse(self, callback: mi.TraversalCallback) -> None:
        for name in ("data", "scale", "offset"):
            callback.put(name, getattr(self, name), mi.ParamFlags.Differentiable)

    def parameters_changed(self, keys: Sequence[str] = ()) -> None:
        self._check()

    def _check(self) -> None:
        self._check_data()
        if not 0 <= self.channel < self.channel_count:
            raise ConfigError(
                f"{self.plugin}: 'channel' is {self.channel}", f"use 0 to {self.channel_count - 1}"
            )
        # A virtual function call cannot evaluate what it captures.
        dr.eval(self.data)

    def _check_data(self) -> None:
        """Raises a ConfigError if the data has a wrong shape."""
        raise NotImplementedError

    def _rows(self) -> mi.UInt32:
        """Rows of the data (UInt32) over which `mean` and `max` go."""
        raise NotImplementedError

    def check_shape(self, shape: mi.Shape) -> None:
        """Raises a ConfigError if the field cannot be put on a shape; this one can be put on any."""

    def locate(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> Located:
        raise NotImplementedError

    def _lookup(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool) -> Located:
        """`locate`, after a check of the shapes."""
        return self.locate(si, active)

    def gather(self, located: Located, channels: range | None = None) -> list[mi.Float]:
        """Interpolated `scale * data + offset` of the channels (default: all), one Float each."""
        values = []
        for channel in range(self.channel_count) if channels is None else channels:
            rows = self._row_values(located, channel)
            value = sum(w * r for w, r in zip(located.weights, rows, strict=True))
            values.append(dr.fma(dr.select(located.active, value, 0), self.scale, self.offset))
        return values

    def _row_values(self, located: Located, channel: int) -> list[mi.Float]:
        """The data of one channel at the K rows of the lookups."""
        rows = (self.channel_count * row + channel for row in located.rows)
        return [dr.gather(mi.Float, self.data.array, row, located.active) for row in rows]

    def eval(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> mi.Color3f | mi.Color1f:
        return self._colour(self._three(self._lookup(si, active)))

    def eval_1(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> mi.Float:
        return self.gather(self._lookup(si, active), range(self.channel, self.channel + 1))[0]

    def eval_3(self, si: mi.SurfaceInteraction3f, active: mi.Bool | bool = True) -> mi.Color3f:
        return self._three(self._lookup(si, active))

    def mean(self) -> mi.Float:
        """Mean over the data's rows of what `eval` returns."""
        return dr.mean(dr.mean(self._row_colours()))

    def max(self) -> float:
        """Largest value in the data's rows of what `eval` returns."""
        return float(dr.max(dr.max(self._row_colours()))[0])

    def is_spatially_varying(self) -> bool:
        return True

    def _description(self, name: str, **own: object) -> str:
        """The text of `to_string`, with the plugin's own properties first."""
        raw = str(self.raw).lower()
        common = {"channel": self.channel, "scale": self.scale, "offset": self.offset, "raw": raw}
        lines = (f"  {key} = {value}" for key, value in (own | common).items())
        return f"{name}[\n" + ",\n".join(lines) + "\n]"

    def _selection(self) -> range:
        """Channels that a colour is made of: three from `channel` on, or `channel` alone."""
        enough = self.channel + 3 <= self.channel_count
        return range(self.channel, self.channel + (3 if enough else 1))

    def _three(self, located: Located) -> mi.Color3f:
        values = self.gather(located, self._selection())
        return mi.Color3f(*values) if len(values) == 3 else mi.Color3f(values[0])

    def _colour(self, rgb: mi.Color3f) -> mi.Color3f | mi.Color1f:
        if mi.is_spectral:
            raise ConfigError(
                f"{self.plugin}: colours need an rgb or mono variant", "roughness and normals work in any"
            )
        if not self.raw:
            rgb = mi.math.srgb_to_linear(dr.clip(rgb, 0, 1))
        return mi.Color1f(mi.luminance(rgb)) if mi.is_monochromatic else rgb

    def _row_colours(self) -> mi.Color3f | mi.Color1f:
        return self._colour(self._three(self._at_rows()))

    def _at_rows(self) -> Located:
        """The lookups that read one row each."""
        return Located((self._rows(),), (mi.Float(1),), mi.Bool(True))
