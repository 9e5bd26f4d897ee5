"""Films that close: where one may end so that its beginning follows, and a cross-fade over what is left."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass

import numpy as np

SAMPLE = 16  # frames whose mean stands for all
BETTER = 1e-4  # by which the difference of a shorter loop must be less


@dataclass(frozen=True)
class Loop:
    """A part of a film that is shown again and again.

    Attributes:
        start: its first frame.
        length: how many frames it has; the one after its last resembles its first.
        fade: frames at its beginning into which those after its end fade.
        difference: of the frames that are faded, root of the mean square, in units of the pictures.
    """

    start: int
    length: int
    fade: int
    difference: float

    def pictures(self, read: Callable[[int], np.ndarray]) -> Iterator[np.ndarray]:
        """The frames of the loop, given those of the film: frame -> (H, W, 3) in [0, 1].

        Frame t of the first `fade` is F(start + length + t) faded into F(start + t) with the weight
        w = (t + 1) / (fade + 1), so that the first one nearly follows the last.
        """
        sample = np.linspace(self.start, self.start + self.length - 1, SAMPLE).round().astype(int)
        mean = np.mean([read(int(k)) for k in sample], axis=0) if self.fade else None
        for t in range(self.length):
            picture = read(self.start + t)
            if t < self.fade:
                after, weight = read(self.start + self.length + t), (t + 1) / (self.fade + 1)
                picture = mean + _faded(after - mean, picture - mean, weight)
            yield np.clip(picture, 0.0, 1.0)


def _faded(first: np.ndarray, second: np.ndarray, weight: float) -> np.ndarray:
    """(1 - w) a + w b, divided by what that takes from the contrast of unlike pictures (Heitz and Neyret
    2018): sqrt((1 - w)^2 + w^2 + 2 w (1 - w) r), where r is their correlation.
    """
    scale = float(np.linalg.norm(first) * np.linalg.norm(second))
    correlation = max(float((first * second).sum()) / scale, 0.0) if scale else 1.0
    contrast = (1 - weight) ** 2 + weight**2 + 2 * weight * (1 - weight) * correlation
    return ((1 - weight) * first + weight * second) / np.sqrt(contrast)


def best_loop(frames: np.ndarray, fade: int, shortest: int, longest: int) -> Loop:
    """The loop whose ends resemble each other most, over all frames that fade; the longest of equal ones.

    Args:
        frames: (N, ...) of the film, small.
        fade: frames to fade over; 0 compares one frame and fades none.
        shortest, longest: how many frames the loop may have; N is at least `longest` plus `fade`, or one.
    """
    window = max(fade, 1)
    flat = frames.reshape(len(frames), -1).astype(np.float64)
    best = Loop(0, longest, fade, np.inf)
    for length in range(longest, shortest - 1, -1):
        squares = ((flat[length:] - flat[:-length]) ** 2).mean(axis=1)
        sums = np.convolve(squares, np.ones(window) / window, mode="valid")
        start = int(sums.argmin())
        difference = float(np.sqrt(max(sums[start], 0.0)))
        if difference < best.difference - BETTER:
            best = Loop(start, length, fade, difference)
    return best
