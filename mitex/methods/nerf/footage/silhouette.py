"""What a picture shows of a volume of voxels."""

from __future__ import annotations

import cv2
import numpy as np

from mitex.methods.nerf.capture.visual_hull import Hull, View, project


def silhouette(hull: Hull, view: View, size: tuple[int, int]) -> np.ndarray:
    """Where voxels are seen, as discs that cover them.

    Args:
        hull: the volume.
        view: the camera; its mask tells the size that the intrinsics belong to.
        size: (height, width) of the result, of the same shape.

    Returns:
        (height, width) bool.
    """
    height, width = size
    centres = hull.low + (np.argwhere(hull.inside) + 0.5) * hull.edge
    pixels, depth = project(centres, view.pose, view.intrinsics, view.distortion)
    scale = width / view.mask.shape[1]
    column, row = np.floor(scale * pixels).astype(np.int64).T
    seen = (depth > 0.0) & (column >= 0) & (row >= 0) & (column < width) & (row < height)
    shown = np.zeros(size, np.uint8)
    shown[row[seen], column[seen]] = 1
    if not seen.any():
        return shown.astype(bool)
    radius = 0.87 * hull.edge * scale * view.intrinsics[0] / float(np.median(depth[seen]))
    return cv2.dilate(shown, disc(radius)).astype(bool)


def disc(radius: float) -> np.ndarray:
    """The kernel of a disc for OpenCV's morphology, of at least one pixel around the middle."""
    side = 2 * max(round(radius), 1) + 1
    return cv2.getStructuringElement(cv2.MORPH_ELLIPSE, (side, side))
