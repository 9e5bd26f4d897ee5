"""Cutting the object out of all pictures: each by itself, then by what all of them agree on."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import replace

import cv2
import numpy as np
from skimage.color import rgb2lab
from skimage.filters import threshold_otsu

from mitex.errors import CaptureError
from mitex.methods.nerf.capture.visual_hull import Hull, project, visual_hull
from mitex.methods.nerf.footage.guess import Guess, in_box, in_middle, on_table
from mitex.methods.nerf.footage.mask_method import MaskMethod
from mitex.methods.nerf.footage.network import Network, half
from mitex.methods.nerf.footage.silhouette import disc, silhouette
from mitex.methods.nerf.footage.site import Site
from mitex.progress import counted
from mitex.runtime.workers import allowed

ROUNDS = (400, 800)  # longer side of the pictures [pixels]; each within what the masks before agree on
ITERATIONS = 3  # of GrabCut in a round
SLACK = 0.03  # how far beyond the hull's silhouette a mask may reach [pictures]
DIFFERENT = (12.0, 40.0)  # distance in CIELAB from which a colour is not the background's: least, most
AGREED = 0.5  # part of the silhouette of what all agree on that a mask must fill


@contextmanager
def _allowed_threads() -> Iterator[None]:
    """Within the context OpenCV uses as many threads as there may be."""
    before = cv2.getNumThreads()
    cv2.setNumThreads(allowed() or before)
    try:
        yield
    finally:
        cv2.setNumThreads(before)


@_allowed_threads()
def cut_out(
    site: Site, pictures: Sequence[np.ndarray], method: MaskMethod, network: Network | None = None
) -> list[np.ndarray]:
    """Masks (H, W) bool of the object, one of each picture (H, W, 3) uint8; empty where none is to be had.

    Args:
        site: the pictures' cameras.
        pictures: to be masked.
        method: how.
        network: that is asked, for the method "network".

    Raises:
        CaptureError: there is no object to be found in that way.
    """
    if network is not None:
        masks = _by_network(network, pictures)
    elif method.kind == "colour":
        masks = _by_colour([_shrunk(picture, ROUNDS[-1]) for picture in pictures], method.colour)
    else:
        masks = _by_points(site, pictures, _guess(site, _shrunk(pictures[0], ROUNDS[0]), method))
    hull = _agreed(site, masks)
    shown = [silhouette(hull, view, mask.shape) for view, mask in zip(site.views, masks, strict=True)]
    masks = [_cleaned(mask & _grown(region)) for mask, region in zip(masks, shown, strict=True)]
    kept = [m & (m.sum() > AGREED * region.sum()) for m, region in zip(masks, shown, strict=True)]
    return [_enlarged(mask, view.mask.shape) for mask, view in zip(kept, site.views, strict=True)]


def _guess(site: Site, first: np.ndarray, method: MaskMethod) -> Guess:
    if method.kind == "plane":
        return on_table(site)
    if method.kind == "hull":
        return in_middle(site)
    height, width = first.shape[:2]
    left, top, wide, tall = np.round(np.array(method.box) * (width, height, width, height)).astype(int)
    trimap = np.full((height, width), cv2.GC_BGD, np.uint8)
    trimap[top : top + tall, left : left + wide] = cv2.GC_PR_FGD
    mask = _grab_cut(first, trimap)
    return in_box(site, _enlarged(mask, site.views[0].mask.shape))


def _by_points(site: Site, pictures: Sequence[np.ndarray], guess: Guess) -> list[np.ndarray]:
    """GrabCut of all pictures, started from sparse points and, from round to round, a tighter volume."""
    volume, masks = guess.volume, []
    for number, side in enumerate(ROUNDS):
        if masks:
            volume = _agreed(site, masks)
        small = [_shrunk(picture, side) for picture in pictures]
        work = f"cutting the object out, round {number + 1} of {len(ROUNDS)}"
        masks = [
            _grab_cut(picture, _trimap(site, view, guess, volume, picture.shape[:2]))
            for view, picture in counted(work, enumerate(small), len(small))
        ]
    return masks


def _trimap(site: Site, view: int, guess: Guess, volume: Hull, size: tuple[int, int]) -> np.ndarray:
    """What GrabCut starts from: (H, W) uint8 of its labels."""
    camera = site.views[view]
    region = _grown(silhouette(volume, camera, size))
    trimap = np.where(region, cv2.GC_PR_FGD, cv2.GC_BGD).astype(np.uint8)
    seen = site.seen(view)
    scale = size[1] / camera.mask.shape[1]
    for points, label, radius in ((guess.off, cv2.GC_BGD, 2), (guess.on, cv2.GC_FGD, 1)):
        chosen = site.points[seen[points[seen]]]
        pixels, _ = project(chosen, camera.pose, camera.intrinsics, camera.distortion)
        for column, row in np.round(scale * pixels - 0.5).astype(int):
            cv2.circle(trimap, (int(column), int(row)), radius, int(label), -1)
    return trimap


def _grab_cut(picture: np.ndarray, trimap: np.ndarray) -> np.ndarray:
    """The mask (H, W) bool that GrabCut (Rother et al. 2004) makes of a picture and its labels."""
    rows, columns = _window(trimap != cv2.GC_BGD)
    labels = np.ascontiguousarray(trimap[rows, columns])
    if not ((labels == cv2.GC_BGD).any() and (labels != cv2.GC_BGD).any()):
        return trimap != cv2.GC_BGD
    models = np.zeros((1, 65)), np.zeros((1, 65))
    cv2.setRNGSeed(0)
    cv2.grabCut(
        np.ascontiguousarray(picture[rows, columns]),
        labels,
        (0, 0, 1, 1),
        *models,
        ITERATIONS,
        cv2.GC_INIT_WITH_MASK,
    )
    mask = np.zeros(trimap.shape, bool)
    mask[rows, columns] = (labels == cv2.GC_FGD) | (labels == cv2.GC_PR_FGD)
    return _cleaned(mask)


def _window(region: np.ndarray) -> tuple[slice, slice]:
    """The rows and columns of a region, with a quarter more around it."""
    slices = []
    for axis in (1, 0):
        index = np.flatnonzero(region.any(axis=axis))
        low, high = (int(index[0]), int(index[-1]) + 1) if len(index) else (0, 1)
        more = (high - low) // 4 + 4
        slices.append(slice(max(low - more, 0), min(high + more, region.shape[1 - axis])))
    return slices[0], slices[1]


def _by_colour(pictures: Sequence[np.ndarray], colour: tuple[int, int, int]) -> list[np.ndarray]:
    """What differs from the background's colour, by a limit that is one for all pictures (Otsu 1979)."""
    background = rgb2lab(np.array(colour, np.uint8)[None, None])[0, 0]
    weights = np.array([0.5, 1.0, 1.0])  # a shadow on the background is still background
    distances = [np.linalg.norm(weights * (rgb2lab(p) - background), axis=2) for p in pictures]
    together = np.concatenate([distance[::4, ::4].ravel() for distance in distances])
    limit = float(np.clip(threshold_otsu(together), *DIFFERENT))
    share = float((together > limit).mean())
    if not 0.01 < share < 0.97:
        raise CaptureError(
            f"{100.0 * (1.0 - share):.0f} % of the pictures have the background's colour",
            "read the colour off a picture, beside the object",
        )
    return [_cleaned(distance > limit) for distance in distances]


def _by_network(network: Network, pictures: Sequence[np.ndarray]) -> list[np.ndarray]:
    """What a network takes for the object, in pictures that it sees one by one."""
    answers = [
        _shrunk(network(picture), ROUNDS[-1])
        for picture in counted("cutting the object out", pictures, len(pictures))
    ]
    limit = half(min(float(a.min()) for a in answers), max(float(a.max()) for a in answers))
    masks = [answer > limit for answer in answers]
    share = float(np.mean([mask.mean() for mask in masks]))
    if not 0.001 < share < 0.97:
        raise CaptureError(
            f"the network takes {100.0 * share:.1f} % of the pictures for the object",
            "give it the size and the colours that it was trained with, or mask in another way",
        )
    return [_cleaned(mask) for mask in masks]


def _agreed(site: Site, masks: Sequence[np.ndarray]) -> Hull:
    """The visual hull of masks at any size."""
    full = [_enlarged(mask, view.mask.shape) for mask, view in zip(masks, site.views, strict=True)]
    views = [replace(view, mask=mask) for mask, view in zip(full, site.views, strict=True) if mask.any()]
    hull = visual_hull(views) if views else None
    if hull is None:
        raise CaptureError(
            "the pictures agree on no object", "mask it in another way, or film it before a calmer background"
        )
    return hull


def _shrunk(picture: np.ndarray, side: int) -> np.ndarray:
    scale = min(side / max(picture.shape[:2]), 1.0)
    size = round(picture.shape[1] * scale), round(picture.shape[0] * scale)
    return cv2.resize(picture, size, interpolation=cv2.INTER_AREA)


def _enlarged(mask: np.ndarray, size: tuple[int, int]) -> np.ndarray:
    values = cv2.resize(mask.astype(np.float32), size[::-1], interpolation=cv2.INTER_LINEAR)
    return values > 0.5


def _grown(region: np.ndarray) -> np.ndarray:
    return cv2.dilate(region.astype(np.uint8), disc(SLACK * max(region.shape))).astype(bool)


def _cleaned(mask: np.ndarray) -> np.ndarray:
    """Without specks and pinholes: the largest piece, opened and with its small holes filled."""
    binary = cv2.morphologyEx(mask.astype(np.uint8), cv2.MORPH_OPEN, disc(1.0))
    count, labels, stats, _ = cv2.connectedComponentsWithStats(binary)
    if count < 2:
        return np.zeros(mask.shape, bool)
    piece = labels == 1 + int(stats[1:, cv2.CC_STAT_AREA].argmax())
    _, holes, sizes, _ = cv2.connectedComponentsWithStats((~piece).astype(np.uint8))
    small = np.flatnonzero(sizes[:, cv2.CC_STAT_AREA] < 0.005 * piece.sum())
    return piece | (np.isin(holes, small) & ~piece)
