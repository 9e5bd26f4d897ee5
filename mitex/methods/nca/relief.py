"""Ties normals to heights, as far as the exemplar's are."""

from __future__ import annotations

from collections.abc import Iterable

import numpy as np
import torch
import torch.nn.functional as F

from mitex.exemplar import Exemplar
from mitex.losses import slope_correlation
from mitex.triples import Layout


class Relief:
    """How much less the normals in views follow from the heights than the exemplar's do.

    Args:
        exemplar: maps to learn, normal and height among them.
        layout: columns of the maps in the values of views.
        sizes: of the exemplar in views [px].
    """

    def __init__(self, exemplar: Exemplar, layout: Layout, sizes: Iterable[int]) -> None:
        self._layout = layout
        self._targets = {}
        for size in sizes:
            maps = exemplar.resized(size).maps
            values = np.concatenate([maps[name] for name in layout], axis=2)
            self._targets[size] = self._correlation(torch.from_numpy(values)[None]).item()

    def __call__(self, views: torch.Tensor, size: int) -> torch.Tensor:
        """From 0 to 2, the mean over views (K, H, W, C) of a plane whose frame is that of the images.

        Args:
            views: values, in which the exemplar is `size` wide.
            size: [px], one of those at construction.
        """
        return F.relu(self._targets[size] - self._correlation(views)).mean()

    def _correlation(self, values: torch.Tensor) -> torch.Tensor:
        (height,), normal = self._layout["height"], list(self._layout["normal"])
        return slope_correlation(values[..., height], values[..., normal])
