"""The colours of an exemplar, from pixels to whole stones, as distributions that a texture shall have.

Gram matrices are sums over many places: they are nearly right when each of many large, separate things has
the mean of their colours. So the means of squares of 1, 4 and 16 texels, in which a stone counts as much as
its colour is its own, are compared as distributions, by the squared Wasserstein-2 distance along six
directions (sliced optimal transport, Rabin, Peyre, Delon and Bernot 2011).
"""

from __future__ import annotations

import torch
import torch.nn.functional as F

from mitex.methods.surface.levels import Levels

POOLED = (0, 2, 4)  # how often colours are pooled before they are compared
WHOLE = (0.5, 2.0)  # of a full group's number of texels: others, at borders and slopes, are left out
LEAST = 256  # values that are compared at least
FAINT = 0.1  # spread along a principal component, of the largest, below which less is expected of it
GOLDEN = (1 + 5**0.5) / 2
# (3, 6) the axes of an icosahedron: unit vectors, spread evenly.
DIRECTIONS = (
    torch.tensor(
        [
            [0.0, 0.0, 1.0, -1.0, GOLDEN, GOLDEN],
            [1.0, -1.0, GOLDEN, GOLDEN, 0.0, 0.0],
            [GOLDEN, GOLDEN, 0.0, 0.0, 1.0, -1.0],
        ]
    )
    / (1 + GOLDEN**2) ** 0.5
)


class Palette:
    """Squared distance of the distributions of colours, on one scale of the texture.

    Args:
        levels: of the surface.
        images: (P, H, W, 3) the exemplar's channel triples on that scale.
        scale: how often texels were pooled to be compared with pixels of the images.
    """

    def __init__(self, levels: Levels, images: torch.Tensor, scale: int = 0) -> None:
        self.groups: list[tuple[torch.Tensor, torch.Tensor]] = []
        self.targets: list[torch.Tensor] = []
        self.axes: list[torch.Tensor] = []
        planes = images.permute(0, 3, 1, 2)
        for pooled in POOLED:
            parent, whole = _groups(levels, scale + pooled, 4.0 ** (scale + pooled))
            side = 1 << pooled
            if len(whole) < LEAST or side > images.shape[1]:
                break
            means = F.avg_pool2d(planes, side, max(side // 4, 1))
            self.groups.append((parent, whole))
            self.axes.append(torch.stack([_axes(colours) for colours in means.flatten(2)]))
            self.targets.append(means.flatten(2).mT @ self.axes[-1])

    def distance(self, colours: torch.Tensor, k: int) -> torch.Tensor:
        """The distance of the distributions, averaged over the sizes of the squares.

        Args:
            colours: (n, 3) the texels' channels of triple `k`, in the order of the levels.
            k: the triple.

        Returns:
            Scalar: about 1 where all colours are alike.
        """
        total = torch.zeros(())
        for groups, axes, targets in zip(self.groups, self.axes, self.targets, strict=True):
            parent, whole = groups
            means = _means(colours, parent)[whole] if len(parent) else colours
            total = total + sliced_distance(means @ axes[k], targets[k])
        return total / max(len(self.groups), 1)


def sliced_distance(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Squared Wasserstein-2 distance of the values of columns, their mean: (n, C), (m, C) to a scalar."""
    ranked = a.sort(dim=0).values
    quantiles = F.interpolate(b.sort(dim=0).values.T[None], size=len(a), mode="linear")[0].T
    return (ranked - quantiles).square().mean()


def _axes(colours: torch.Tensor) -> torch.Tensor:
    """(3, 6) what takes colours to coordinates in which (3, n) of them vary by 1 along all directions.

    So a difference in hue counts as much as one in brightness, which varies far more in most exemplars.
    """
    spread, components = torch.linalg.eigh(torch.cov(colours))
    spread = spread.clamp(min=max(float(spread[-1]) * FAINT**2, 1e-6)).sqrt()
    return components / spread @ DIRECTIONS


def _groups(levels: Levels, depth: int, full: float) -> tuple[torch.Tensor, torch.Tensor]:
    """(n,) the group of each texel after `depth` poolings, none if 0, and the groups that are whole."""
    if depth == 0:
        return torch.empty(0, dtype=torch.int64), torch.arange(len(levels.order))
    sizes = torch.from_numpy(levels.levels[0].sizes.astype("int64"))
    parent = torch.repeat_interleave(sizes)
    for level in levels.levels[1:depth]:
        parent = torch.repeat_interleave(torch.from_numpy(level.sizes.astype("int64")))[parent]
    count = torch.bincount(parent)
    return parent, torch.nonzero((count >= WHOLE[0] * full) & (count <= WHOLE[1] * full))[:, 0]


def _means(values: torch.Tensor, parent: torch.Tensor) -> torch.Tensor:
    count = int(parent[-1]) + 1
    total = values.new_zeros(count, values.shape[1]).index_add(0, parent, values)
    return total / torch.bincount(parent, minlength=count)[:, None]
