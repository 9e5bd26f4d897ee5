"""The colours of an exemplar, of pixels and of whole stones, as distributions that a texture shall have.

Gram matrices are sums over many places: they are nearly right when each of many large, separate things has
the mean of their colours. So the texels, and means of squares in which a stone's colour is left, are compared
as distributions: by the squared Wasserstein-2 distance along six directions (sliced optimal transport, Rabin,
Peyre, Delon and Bernot 2011).
"""

from __future__ import annotations

import math

import torch
import torch.nn.functional as F

from mitex.methods.surface.levels import Levels

SQUARES = 16  # along the exemplar's side
WHOLE = (0.5, 2.0)  # of a full square's number of texels: others, at borders and slopes, are left out
LEAST = 32  # squares on a surface; of fewer only texels are compared
FAINT = 0.1  # of the texels' largest spread: smaller ones of squares count less
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
    """Squared distances of the distributions of colours, on one scale of the texture.

    Texels are compared in units of their largest spread. A texel's hue is left to the network: where it would
    count as much as brightness, the noise of the start would become coloured speckle. Of squares all
    directions count alike, so that stones of different hues stay different.

    Args:
        levels: of the surface.
        images: (P, H, H, 3) the exemplar's channel triples on that scale.
        scale: how often texels were pooled to be compared with pixels of the images.
        steps: (n,) how far apart the taps of texels are, if that varies.
    """

    def __init__(
        self, levels: Levels, images: torch.Tensor, scale: int = 0, steps: torch.Tensor | None = None
    ) -> None:
        planes = images.permute(0, 3, 1, 2)
        depth = min(square_depth(images.shape[1]), len(levels.levels) - scale)
        self.groups = [_groups(levels, scale, steps)]
        self.targets, self.axes = [planes.flatten(2).mT], []
        spreads = [float(_components(colours)[0][-1]) for colours in planes.flatten(2)]
        self.axes.append(torch.stack([DIRECTIONS / spread for spread in spreads]))
        squares = _groups(levels, scale + depth, steps)
        if depth and len(squares[1]) >= LEAST:
            means = F.avg_pool2d(planes, 1 << depth, max((1 << depth) // 4, 1)).flatten(2)
            self.groups.append(squares)
            self.targets.append(means.mT)
            self.axes.append(torch.stack([_whitening(*pair) for pair in zip(means, spreads, strict=True)]))

    def distance(self, colours: torch.Tensor, k: int) -> torch.Tensor:
        """The distance of the distributions of texels, and that of squares, added.

        Args:
            colours: (n, 3) the texels' channels of triple `k`, in the order of the levels.
            k: the triple.

        Returns:
            Scalar: of the order of 1 where all colours are alike.
        """
        total = torch.zeros(())
        for (parent, whole), axes, targets in zip(self.groups, self.axes, self.targets, strict=True):
            means = _means(colours, parent)[whole]
            total = total + sliced_distance(means @ axes[k], targets[k] @ axes[k])
        return total


def square_depth(side: int) -> int:
    """How often texels are pooled to the squares of an exemplar of `side` pixels."""
    return round(math.log2(max(side / SQUARES, 1)))


def sliced_distance(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Squared Wasserstein-2 distance of the values of columns, their mean: (n, C), (m, C) to a scalar."""
    ranked = a.sort(dim=0).values
    quantiles = F.interpolate(b.sort(dim=0).values.T[None], size=len(a), mode="linear")[0].T
    return (ranked - quantiles).square().mean()


def _components(colours: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor]:
    """Spreads (3,), ascending, and directions (3, 3), by columns, of the principal components of (3, n)."""
    variance, directions = torch.linalg.eigh(torch.cov(colours))
    return variance.clamp(min=1e-8).sqrt(), directions


def _whitening(colours: torch.Tensor, largest: float) -> torch.Tensor:
    """(3, 6) what takes colours to coordinates in which (3, n) of them vary by 1 along all directions.

    Less where their spread is less than `FAINT` of `largest`.
    """
    spread, directions = _components(colours)
    return directions / spread.clamp(min=FAINT * largest) @ DIRECTIONS


def _groups(
    levels: Levels, depth: int, steps: torch.Tensor | None = None
) -> tuple[torch.Tensor, torch.Tensor]:
    """(n,) the group of each texel after `depth` poolings, and the groups that are whole.

    Groups are as many times larger as the `steps` (n,) of the taps.
    """
    parent = torch.from_numpy(levels.groups(depth))
    count, full = torch.bincount(parent), torch.tensor(4.0**depth)
    if steps is not None and depth:
        full = (full * _means(steps.square()[:, None], parent)[:, 0]).clamp(min=1.0)
    return parent, torch.nonzero((count >= WHOLE[0] * full) & (count <= WHOLE[1] * full))[:, 0]


def _means(values: torch.Tensor, parent: torch.Tensor) -> torch.Tensor:
    """(m, C) means of the values (n, C) of each group."""
    count = int(parent[-1]) + 1
    if count == len(values):
        return values
    total = values.new_zeros(count, values.shape[1]).index_add(0, parent, values)
    return total / torch.bincount(parent, minlength=count)[:, None]
