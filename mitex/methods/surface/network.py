"""VGG-16 on a surface: the weights of the image network, the neighbourhoods of the levels."""

from __future__ import annotations

from collections.abc import Iterable, Mapping

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.features.frozen import FrozenStack, GramTap, Operation, Tap
from mitex.features.vgg import LAYERS, MEAN_RGB, Weights, convolutions
from mitex.methods.surface.levels import Levels
from mitex.methods.surface.operations import BilinearConv, SurfaceConv, SurfacePool
from mitex.runtime import bfloat16_is_fast

POOLED = tuple(f"pool{n}" for n in range(1, 6))
ALL_LAYERS = tuple(  # in the order in which they are computed
    name for n in range(1, 6) for name in (*(x for x in LAYERS if x.startswith(f"relu{n}_")), f"pool{n}")
)


class SurfaceVgg:
    """VGG-16 whose convolutions and poolings run on a surface.

    Args:
        levels: of the surface.
        pool: "average" or "max".
        precision: "bfloat16", "float32", or "auto": bfloat16 where the CPU multiplies it natively.
        bilinear: False makes the first convolution read nearest texels too (an ablation).
        scale: the image is the texels pooled so many times; the first convolution then reads nearest ones.
        weights: layer -> weight, bias; None takes the package's (random ones are an ablation).
    """

    def __init__(
        self,
        levels: Levels,
        pool: str = "average",
        precision: str = "auto",
        bilinear: bool = True,
        scale: int = 0,
        weights: Weights | None = None,
    ) -> None:
        fast = precision == "bfloat16" or (precision == "auto" and bfloat16_is_fast())
        self.dtype = torch.bfloat16 if fast else torch.float32
        self.texels = len(levels.order)
        self.operations: list[Operation] = []
        self.index: dict[str, int] = {}
        layers = convolutions(pool, normalised=False) if weights is None else weights
        for level in levels.levels[:scale]:
            self.operations.append(SurfacePool("average", level.sizes))
        for n, level in enumerate(levels.levels[scale : scale + len(POOLED)]):
            around = level.neighbourhood
            for name in (name for name in LAYERS if name.startswith(f"relu{n + 1}_")):
                if name != "relu1_1":
                    self._append(name, SurfaceConv(*layers[name], self.dtype, around))
                    continue
                index, share = levels.index, levels.weight
                if scale or not bilinear:
                    index, share = level.taps[:, :, None], np.ones((*level.taps.shape, 1), np.float32)
                self._append(name, BilinearConv(*layers[name], self.dtype, index, share))
            self._append(POOLED[n], SurfacePool(pool, level.sizes))

    def features(self, texels: torch.Tensor, layers: Iterable[str]) -> dict[str, torch.Tensor]:
        """Layer -> (n, C) float32 of texel colours (N, 3), sRGB in [0, 1], in the order of `Levels`."""
        return self._run(texels, {name: Tap(self._place(name)) for name in layers})

    def gram_matrices(self, texels: torch.Tensor, layers: Iterable[str]) -> dict[str, torch.Tensor]:
        """Layer -> (C, C), mean outer products of the features, differentiable in `texels` (once)."""
        return self._run(texels, {name: GramTap(self._place(name)) for name in layers})

    def compared(
        self, texels: torch.Tensor, gram_layers: Iterable[str], whole_layers: Iterable[str]
    ) -> tuple[dict[str, torch.Tensor], dict[str, torch.Tensor]]:
        """`gram_matrices` of some layers and `features` of others, in one pass."""
        taps: dict[str, Tap | GramTap] = {f"gram {name}": GramTap(self._place(name)) for name in gram_layers}
        taps |= {f"whole {name}": Tap(self._place(name)) for name in whole_layers}
        found = [(name.split(), value) for name, value in self._run(texels, taps).items()]
        grams = {name: value for (kind, name), value in found if kind == "gram"}
        return grams, {name: value for (kind, name), value in found if kind == "whole"}

    def _append(self, name: str, operation: Operation) -> None:
        self.index[name] = len(self.operations)
        self.operations.append(operation)

    def _place(self, layer: str) -> int:
        if layer not in self.index:
            raise ConfigError(f"there is no layer {layer!r}", f"use {', '.join(self.index)}")
        return self.index[layer]

    def _run(self, texels: torch.Tensor, taps: Mapping[str, Tap | GramTap]) -> dict[str, torch.Tensor]:
        if texels.shape != (self.texels, 3):
            raise ConfigError(f"texels of shape {tuple(texels.shape)}", f"give ({self.texels}, 3)")
        chosen = list(taps.values())
        depth = max(tap.index for tap in chosen) + 1
        centred = texels * 255 - torch.tensor(MEAN_RGB)
        return dict(zip(taps, FrozenStack.apply(centred, self.operations[:depth], chosen), strict=True))
