"""The pixels of a capture, to draw rays from."""

from __future__ import annotations

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Any, TypeVar

import numpy as np
import torch

from mitex.methods.nerf.capture.capture import Capture

Array = TypeVar("Array", np.ndarray, torch.Tensor)


@dataclass
class Batch:
    """R rays, equally many through each of P pixels, one pixel after another, and what the pixels show.

    Attributes:
        view: (R,) int64 index of the image.
        origins, directions: (R, 3) float32 in the scene cube, directions of length 1.
        colours: (P, 3) float32 sRGB in [0, 1], straight.
        alpha: (P, 1) float32.
    """

    view: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    colours: torch.Tensor
    alpha: torch.Tensor

    def pixel_mean(self, values: Array) -> Array:
        """Means (P, ...) of values (R, ...) of the rays of each pixel."""
        by_pixel: Any = values.reshape(len(self.colours), -1, *values.shape[1:])
        return by_pixel.mean(1)


class Pixels:
    """All pixels of a capture in one row."""

    def __init__(self, capture: Capture) -> None:
        self.capture = capture
        self._widths = np.array([image.shape[1] for image in capture.images])
        self._ends = np.cumsum([image.shape[0] * image.shape[1] for image in capture.images])

    @cached_property
    def _values(self) -> np.ndarray:
        """(P, 4) uint8 of all images: a copy of the whole capture, which single images do without."""
        return np.concatenate([image.reshape(-1, 4) for image in self.capture.images])

    def draw(self, count: int, one_view: bool, generator: torch.Generator, across: int = 1) -> Batch:
        """`count` rays through pixels of one image or of all, each as likely as the others.

        A pixel has `across` x `across` rays, each at a random place of its own part; a single one goes
        through its centre.
        """
        starts = np.concatenate([[0], self._ends[:-1]])
        first, last = 0, int(self._ends[-1])
        if one_view:
            view = int(torch.randint(len(self._ends), (), generator=generator))
            first, last = int(starts[view]), int(self._ends[view])
        pixels = count // across**2
        index = torch.randint(first, last, (pixels,), generator=generator).numpy()
        views = np.searchsorted(self._ends, index, side="right")
        rows, columns = np.divmod(index - starts[views], self._widths[views])
        inside = np.full((pixels, across**2, 2), 0.5)
        if across > 1:
            inside = torch.rand(inside.shape, generator=generator).numpy()
        return self._batch(views, np.stack([columns, rows], 1), inside, self._values[index])

    def image(self, view: int, longest: int, across: int = 1) -> tuple[Batch, tuple[int, int]]:
        """A whole image, thinned out to at most `longest` pixels a side; the batch, and its (H, W).

        A pixel has `across` x `across` rays, through the centres of its parts.
        """
        image = self.capture.images[view]
        stride = -(-max(image.shape[:2]) // longest)
        thin = image[::stride, ::stride]
        rows, columns = np.mgrid[0 : image.shape[0] : stride, 0 : image.shape[1] : stride]
        corners = np.stack([columns.ravel(), rows.ravel()], 1)
        inside = np.full((len(corners), across**2, 2), 0.5)
        return self._batch(np.full(len(corners), view), corners, inside, thin.reshape(-1, 4)), thin.shape[:2]

    def _batch(self, views: np.ndarray, corners: np.ndarray, inside: np.ndarray, values: np.ndarray) -> Batch:
        """Of P pixels: their images, their first corners (P, 2), and where in its part of the pixel each ray
        (P, K, 2) goes, in [0, 1]."""
        across = math.isqrt(inside.shape[1])
        parts = np.stack(np.meshgrid(np.arange(across), np.arange(across)), -1).reshape(-1, 2)
        places = (corners[:, None] + (parts + inside) / across).reshape(-1, 2)
        views = views.repeat(inside.shape[1])
        origins, directions = self.capture.rays(views, places)
        rgba = torch.from_numpy(values.astype(np.float32) / 255)
        return Batch(views, origins, directions, rgba[:, :3], rgba[:, 3:])
