"""The pixels of a capture, to draw rays from."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
import torch

from mitex.methods.nerf.capture.capture import Capture


@dataclass
class Batch:
    """R rays and what their pixels show.

    Attributes:
        view: (R,) int64 index of the image.
        origins, directions: (R, 3) float32 in the scene cube, directions of length 1.
        colours: (R, 3) float32 sRGB in [0, 1], straight.
        alpha: (R, 1) float32.
    """

    view: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    colours: torch.Tensor
    alpha: torch.Tensor


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

    def draw(self, count: int, one_view: bool, generator: torch.Generator) -> Batch:
        """`count` pixels, of one image or of all, each as likely as the others."""
        starts = np.concatenate([[0], self._ends[:-1]])
        first, last = 0, int(self._ends[-1])
        if one_view:
            view = int(torch.randint(len(self._ends), (), generator=generator))
            first, last = int(starts[view]), int(self._ends[view])
        index = torch.randint(first, last, (count,), generator=generator).numpy()
        views = np.searchsorted(self._ends, index, side="right")
        rows, columns = np.divmod(index - starts[views], self._widths[views])
        return self._batch(views, np.stack([columns, rows], 1) + 0.5, self._values[index])

    def image(self, view: int, longest: int) -> tuple[Batch, tuple[int, int]]:
        """A whole image, thinned out to at most `longest` pixels a side; the batch, and its (H, W)."""
        image = self.capture.images[view]
        stride = -(-max(image.shape[:2]) // longest)
        thin = image[::stride, ::stride]
        rows, columns = np.mgrid[0 : image.shape[0] : stride, 0 : image.shape[1] : stride]
        places = np.stack([columns.ravel(), rows.ravel()], 1) + 0.5
        return self._batch(np.full(len(places), view), places, thin.reshape(-1, 4)), thin.shape[:2]

    def _batch(self, views: np.ndarray, places: np.ndarray, values: np.ndarray) -> Batch:
        origins, directions = self.capture.rays(views, places)
        rgba = torch.from_numpy(values.astype(np.float32) / 255)
        return Batch(views, origins, directions, rgba[:, :3], rgba[:, 3:])
