"""VGG on a surface: the weights of the image network, the neighbourhoods of the levels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import cache

import torch

from mitex.errors import ConfigError
from mitex.features.frozen import FrozenStack, GramTap, Operation, Tap
from mitex.features.vgg import MEAN_RGB, Weights, convolutions
from mitex.methods.surface.levels import Levels
from mitex.methods.surface.operations import BilinearConv, Kernel, SurfaceConv, SurfacePool
from mitex.methods.surface.regions import bisect
from mitex.runtime import uses_bfloat16

POOLED = tuple(f"pool{n}" for n in range(1, 6))
FIRST = "relu1_1"  # reads the texels


class SurfaceVgg:
    """VGG whose convolutions and poolings run on a surface.

    Args:
        levels: of the surface.
        pool: "average" or "max".
        precision: "bfloat16", "float32", or "auto": bfloat16 where the CPU multiplies it natively.
        bilinear: False makes the first convolution read nearest texels too (an ablation).
        scale: how often the texels are pooled before the network sees them. The first convolution then reads
            nearest ones.
        weights: layer -> weight, bias, of VGG-16, VGG-19 or random ones; None takes the package's VGG-16.
        normalised: of the package's weights, as of `Vgg16`.

    Attributes:
        texels: number of texels N.
        counts: layer -> number of feature vectors.
    """

    def __init__(
        self,
        levels: Levels,
        pool: str = "average",
        precision: str = "auto",
        bilinear: bool = True,
        scale: int = 0,
        weights: Weights | None = None,
        normalised: bool = False,
    ) -> None:
        self.dtype = torch.bfloat16 if uses_bfloat16(precision) else torch.float32
        self.texels = len(levels.order)
        self.operations: list[Operation] = []
        self.index: dict[str, int] = {}
        self.counts: dict[str, int] = {}
        self._levels = levels
        self._depth: dict[str, int] = {}
        self._regions: dict[tuple[str, int], list[torch.Tensor]] = {}
        kernels = _kernels(weights, self.dtype) if weights else _shipped(pool, normalised, self.dtype)
        for level in levels.levels[:scale]:
            self.operations.append(SurfacePool("average", level.sizes))
        for n, level in enumerate(levels.levels[scale : scale + len(POOLED)]):
            around, count = level.neighbourhood, len(level.taps)
            for name in (name for name in kernels if name.startswith(f"relu{n + 1}_")):
                if name != FIRST:
                    self._append(name, SurfaceConv(kernels[name], around), count, scale + n)
                    continue
                lookup = level.nearest if scale or not bilinear else levels.lookup
                self._append(name, BilinearConv(kernels[name], self.dtype, lookup), count, scale + n)
            self._append(POOLED[n], SurfacePool(pool, level.sizes), len(level.sizes), scale + n + 1)

    def features(self, texels: torch.Tensor, layers: Iterable[str]) -> dict[str, torch.Tensor]:
        """Layer -> (n, C) float32 of texel colours (N, 3), sRGB in [0, 1], in the order of `Levels`."""
        return self.read(texels, {name: Tap(self.index_of(name)) for name in layers})

    def read(self, texels: torch.Tensor, taps: Mapping[str, Tap | GramTap]) -> dict[str, torch.Tensor]:
        """What taps give of texel colours (N, 3), sRGB in [0, 1], under their names, in one pass.

        Raises:
            ConfigError: colours of another shape.
        """
        if texels.shape != (self.texels, 3):
            raise ConfigError(f"texels of shape {tuple(texels.shape)}", f"give ({self.texels}, 3)")
        outputs = list(taps.values())
        depth = max(tap.index for tap in outputs) + 1
        centred = texels * 255 - torch.tensor(MEAN_RGB)
        return dict(zip(taps, FrozenStack.apply(centred, self.operations[:depth], outputs), strict=True))

    def index_of(self, layer: str) -> int:
        """The operation that gives a layer.

        Raises:
            ConfigError: there is no such layer.
        """
        if layer not in self.index:
            raise ConfigError(f"there is no layer {layer!r}", f"use {', '.join(self.index)}")
        return self.index[layer]

    def regions(self, layer: str, count: int) -> list[torch.Tensor]:
        """The elements of a layer cut into `count` compact parts of the surface: int64 indices of each."""
        if (layer, count) not in self._regions:
            parts = bisect(self._levels.positions[self._depth[layer]], count)
            self._regions[layer, count] = [torch.from_numpy(part) for part in parts]
        return self._regions[layer, count]

    def _append(self, name: str, operation: Operation, count: int, level: int) -> None:
        self.index[name] = len(self.operations)
        self.operations.append(operation)
        self.counts[name], self._depth[name] = count, level


def _kernels(weights: Weights, dtype: torch.dtype) -> dict[str, Kernel]:
    """Layer -> its kernel for values of a type; the first one's are float32."""
    types = {FIRST: torch.float32}
    return {name: Kernel.of(*layer, types.get(name, dtype)) for name, layer in weights.items()}


@cache
def _shipped(pool: str, normalised: bool, dtype: torch.dtype) -> Mapping[str, Kernel]:
    """Kernels of the package's weights, which networks on all scales and surfaces share: up to 118 MB."""
    return _kernels(convolutions(pool, normalised), dtype)
