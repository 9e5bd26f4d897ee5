"""Which pictures to keep: sharp ones; of a video's frames those from different places, of one brightness."""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from scipy import ndimage

from mitex.colour import LUMINANCE
from mitex.images import resize
from mitex.methods.nerf.capture.capture import MIN_VIEWS
from mitex.methods.nerf.footage.pictures import Picture

NEIGHBOURS = 5  # windows on either side that a frame is compared with
BLURRED = 0.4  # part of its neighbours' sharpness below which a frame is blurred
STOPS = 0.5  # of exposure that a frame may differ from its neighbours
ALIKE = 0.12  # mean difference of two thumbnails from one place, in standard deviations
THUMBNAIL = 32  # side [pixels]
REASONS = {"blurred": "blurred", "exposure": "too dark or too bright", "alike": "like the one before"}


@dataclass(frozen=True, eq=False)
class FrameQuality:
    """What a frame is judged by.

    Attributes:
        sharpness: mean squared gradient of the luma (Tenengrad) over its squared mean, whatever the exposure.
        brightness: mean luma in [0, 1].
        thumbnail: (32, 32) float32, mean 0 and standard deviation 1.
    """

    sharpness: float
    brightness: float
    thumbnail: np.ndarray


def frame_quality(pixels: np.ndarray) -> FrameQuality:
    """Judges a picture (H, W, 3) uint8."""
    luma = (pixels.astype(np.float32) @ LUMINANCE) / 255.0
    smooth = ndimage.gaussian_filter(luma, 1.0)  # noise of the sensor is no sharpness
    rows, columns = np.gradient(smooth)
    brightness = float(luma.mean())
    small = resize(luma[..., None], THUMBNAIL, THUMBNAIL)[..., 0]
    thumbnail = (small - small.mean()) / max(float(small.std()), 1e-3)
    sharpness = float((rows**2 + columns**2).mean()) / max(brightness, 1e-3) ** 2
    return FrameQuality(sharpness, brightness, thumbnail)


def sharpest(pictures: Iterable[Picture], count: int, frames: int) -> Iterator[tuple[Picture, FrameQuality]]:
    """The sharpest picture of each of `frames` equal parts of `count` pictures, with its quality.

    The very first one stands for its part, whatever its quality.
    """
    best: tuple[Picture, FrameQuality] | None = None
    window = 0
    for number, picture in enumerate(pictures):
        if number * frames // count > window and best is not None:
            yield best
            best, window = None, number * frames // count
        if best is not None and not window:
            continue
        quality = frame_quality(picture.pixels)
        if best is None or quality.sharpness > best[1].sharpness:
            best = picture, quality
    if best is not None:
        yield best


def faults(qualities: Sequence[FrameQuality]) -> list[str]:
    """What speaks against each frame of a video: a key of `REASONS`, or "" for those to keep."""
    sharp = np.array([one.sharpness for one in qualities])
    stops = np.log2([max(one.brightness, 1e-3) for one in qualities])
    verdicts = []
    last = None
    for k, one in enumerate(qualities):
        around = slice(max(k - NEIGHBOURS, 0), k + NEIGHBOURS + 1)
        if sharp[k] < BLURRED * np.median(sharp[around]):
            verdict = "blurred"
        elif abs(stops[k] - np.median(stops[around])) > STOPS:
            verdict = "exposure"
        elif last is not None and np.abs(one.thumbnail - last.thumbnail).mean() < ALIKE:
            verdict = "alike"
        else:
            verdict, last = "", one
        verdicts.append(verdict)
    return verdicts


def blurred_photos(qualities: Sequence[FrameQuality]) -> list[str]:
    """The same of photos in order, of which none but blurred ones go, and none if too few would be left."""
    verdicts = ["blurred" if verdict == "blurred" else "" for verdict in faults(qualities)]
    return verdicts if verdicts.count("") >= MIN_VIEWS else [""] * len(verdicts)


def reasons(verdicts: Sequence[str]) -> str:
    """Why frames were left out, in words: "6 blurred, 2 like the one before"; "" if none was."""
    counts = Counter(verdicts)
    return ", ".join(f"{counts[key]} {words}" for key, words in REASONS.items() if counts[key])
