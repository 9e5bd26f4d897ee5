"""A first guess where the object is: a volume around it, and sparse points that are or are not on it."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy.sparse import csr_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from mitex.errors import CaptureError
from mitex.methods.nerf.capture.visual_hull import RESOLUTION, Hull, View, project
from mitex.methods.nerf.footage.site import Site
from mitex.methods.nerf.footage.table import Plane, find_table

CLEAR = 0.02  # height above a table from which a point is on the object [distances]
AROUND = 0.6  # farthest point of the object from the middle [distances]
GAP = 0.08  # between points of one thing, at most [distances]
MARGIN = 1.15  # radius of the ball around the object's points to what they need
WIDE = 1.5  # the same where only its middle is known
CORE = 0.15  # radius of the middle of a picture [its shorter side]
LEAST = 20  # points of an object


@dataclass(frozen=True, eq=False)
class Guess:
    """Where the object is.

    Attributes:
        volume: that contains it.
        on, off: (P,) bool, sparse points that are on the object, and that are not.
    """

    volume: Hull
    on: np.ndarray
    off: np.ndarray


def on_table(site: Site) -> Guess:
    """What stands on the table in the middle: the largest group of points above it.

    Raises:
        CaptureError: there is no table, or nothing on it.
    """
    table = find_table(site)
    height = table.height(site.points)
    near = np.linalg.norm(site.points - site.middle, axis=1) < AROUND * site.distance
    candidates = np.flatnonzero(near & (height > CLEAR * site.distance))
    on = np.zeros(len(site.points), bool)
    on[candidates[_largest_group(site.points[candidates], GAP * site.distance)]] = True
    return _around(site, on, table=table)


def in_middle(site: Site) -> Guess:
    """What is in the middle of the pictures, and nearer than where the cameras' axes meet.

    Raises:
        CaptureError: no points are there.
    """
    on = np.zeros(len(site.points), bool)
    for k, view in enumerate(site.views):
        seen = site.seen(k)
        pixels, depth = project(site.points[seen], view.pose, view.intrinsics, view.distortion)
        height, width = view.mask.shape
        off_centre = np.linalg.norm(pixels - (0.5 * width, 0.5 * height), axis=1)
        far = np.linalg.norm(view.pose[:, 3] - site.middle)
        on[seen[(off_centre < CORE * min(height, width)) & (depth < far)]] = True
    return _around(site, on, margin=WIDE)


def in_box(site: Site, mask: np.ndarray) -> Guess:
    """What a mask (H, W) of the first view shows.

    Raises:
        CaptureError: no points are there.
    """
    view = site.views[0]
    seen = site.seen(0)
    pixels, _ = project(site.points[seen], view.pose, view.intrinsics, view.distortion)
    column, row = np.floor(pixels).astype(np.int64).T
    height, width = mask.shape
    inside = (column >= 0) & (row >= 0) & (column < width) & (row < height)
    shown = inside & mask[row.clip(0, height - 1), column.clip(0, width - 1)]
    on = np.zeros(len(site.points), bool)
    on[seen[shown]] = True
    return _around(site, on, front=view)


def _around(
    site: Site, on: np.ndarray, margin: float = MARGIN, table: Plane | None = None, front: View | None = None
) -> Guess:
    """A ball around points, above the table; points that one view shows are on the ball's near half."""
    if on.sum() < LEAST:
        raise CaptureError(
            f"only {on.sum()} points of an object were found",
            "fill more of the pictures with it, or mask it in another way",
        )
    points = site.points[on]
    low, high = np.quantile(points, (0.01, 0.99), axis=0)
    centre = 0.5 * (low + high)
    radius = margin * float(np.quantile(np.linalg.norm(points - centre, axis=1), 0.99))
    if front is not None:
        away = centre - front.pose[:, 3]
        centre = centre + 0.4 * radius * away / np.linalg.norm(away)
        radius *= 1.2
    edge = 2.0 * radius / RESOLUTION
    voxels = np.indices((RESOLUTION,) * 3).reshape(3, -1).T
    places = centre - radius + (voxels + 0.5) * edge
    inside = np.linalg.norm(places - centre, axis=1) < radius
    off = np.linalg.norm(site.points - centre, axis=1) > 1.05 * radius
    if table is not None:
        inside &= table.height(places) > 0.0
        off |= table.height(site.points) < 0.5 * CLEAR * site.distance
    return Guess(Hull(inside.reshape((RESOLUTION,) * 3), centre - radius, edge), on, off & ~on)


def _largest_group(points: np.ndarray, gap: float) -> np.ndarray:
    """Which points (N, 3) are in the largest group without gaps wider than `gap`, (N,) bool."""
    pairs = KDTree(points).query_pairs(gap, output_type="ndarray") if len(points) else np.zeros((0, 2), int)
    graph = csr_array((np.ones(len(pairs)), pairs.T), shape=(len(points), len(points)))
    labels = connected_components(graph, directed=False)[1]
    return labels == np.bincount(labels, minlength=1).argmax()
