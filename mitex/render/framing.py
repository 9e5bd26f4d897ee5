"""Where the camera stands so that an object fills the picture."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from scipy.spatial import ConvexHull, QhullError

FOV = math.radians(26)  # a portrait lens: little perspective distortion
MARGIN = 0.10  # of the picture's half side, kept free on each side


@dataclass(frozen=True)
class View:
    """A camera: position and the point looked at, (3,) each; up is +y."""

    origin: np.ndarray
    target: np.ndarray


def rotation(azimuth: float) -> np.ndarray:
    """(3, 3) rotation that turns the object so that a camera on +z sees it from `azimuth` [rad].

    Azimuth 0 is the object's +z side, pi / 2 its +x side.
    """
    c, s = math.cos(azimuth), math.sin(azimuth)
    return np.array([[c, 0.0, -s], [0.0, 1.0, 0.0], [s, 0.0, c]])


def hull(points: np.ndarray) -> np.ndarray:
    """The points that can be outermost in a view: corners of the convex hull; all, for flat objects."""
    try:
        return points[ConvexHull(points).vertices]
    except (QhullError, ValueError):
        return points


def fit_view(points: np.ndarray, elevation: float) -> View:
    """A square view along -z, from `elevation` above, in which all points lie within the margin and touch it.

    Args:
        points: (N, 3).
        elevation: of the camera [rad].
    """
    forward = np.array([0.0, -math.sin(elevation), -math.cos(elevation)])
    up = np.array([0.0, math.cos(elevation), -math.sin(elevation)])
    # Camera coordinates: right, up, and towards the camera.
    local = points.astype(np.float64) @ np.stack([[1.0, 0.0, 0.0], up, -forward], axis=1)
    slope = math.tan(0.5 * FOV) * (1.0 - MARGIN)
    # A point is in the frame if |x - cx| <= slope (d - z). Each side of the frame is therefore one plane, and
    # the outermost point of each fixes two of them per axis: cx and the distance that this axis needs.
    centre, distance = np.zeros(2), np.zeros(2)
    for axis in range(2):
        right = (local[:, axis] + slope * local[:, 2]).max()
        left = (local[:, axis] - slope * local[:, 2]).min()
        centre[axis] = 0.5 * (right + left)
        distance[axis] = 0.5 * (right - left) / slope
    target = centre[0] * np.array([1.0, 0.0, 0.0]) + centre[1] * up
    # Not into the object, even if it is a needle along the view.
    reach = max(distance.max(), local[:, 2].max() + 0.1)
    return View(origin=target - reach * forward, target=target)
