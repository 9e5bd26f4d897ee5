"""Where the object is: a visual hull carved from the masks on a coarse grid."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy import ndimage

from mitex.methods.nerf.capture.distortion import distort, undistort

RESOLUTION = 64  # voxels along a side
ROUNDS = 2  # grids, each around what the one before left
DISSENT = 0.05  # part of the views that may call a voxel background: their masks may be wrong
COVERAGE = 0.5  # part of the views that must tell of a voxel
MASK_SIZE = 256  # longer side of the masks that carve [pixels]


@dataclass(frozen=True, eq=False)
class View:
    """A mask and its camera.

    Attributes:
        mask: (H, W) bool.
        pose: (3, 4) camera -> world; x right, y up, looks along -z.
        intrinsics: (4,) fx, fy, cx, cy [pixels].
        distortion: (4,) k1, k2, p1, p2.
    """

    mask: np.ndarray
    pose: np.ndarray
    intrinsics: np.ndarray
    distortion: np.ndarray

    @cached_property
    def whole(self) -> bool:
        """Whether the frame cuts nothing off: all of the object is in it."""
        return not any(side.any() for side in (self.mask[[0, -1]], self.mask[:, [0, -1]]))


@dataclass(frozen=True, eq=False)
class Hull:
    """A grid of cubic voxels; those that the masks leave are True.

    Attributes:
        inside: (R, R, R) bool, indexed by x, y, z.
        low: (3,) the grid's lower corner in the world.
        edge: of a voxel [world units].
    """

    inside: np.ndarray
    low: np.ndarray
    edge: float

    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Lower and upper corner of the voxels inside, (3,) each; there must be one."""
        index = np.argwhere(self.inside)
        return self.low + index.min(axis=0) * self.edge, self.low + (index.max(axis=0) + 1) * self.edge

    def contains(self, points: np.ndarray) -> np.ndarray:
        """Which of the points (N, 3) are in a voxel inside, (N,) bool."""
        index = np.floor((points - self.low) / self.edge).astype(np.int64)
        valid = ((index >= 0) & (index < len(self.inside))).all(axis=1)
        return valid & self.inside[tuple(index.clip(0, len(self.inside) - 1).T)]


def visual_hull(views: Sequence[View]) -> Hull | None:
    """What the masks leave of the space around the point that the cameras look at.

    A voxel stays while it may touch the object in all views but for a few. Views whose frame cuts the object
    off say nothing about what is outside; enough views must say something. The first grid reaches to the
    farthest camera, the second covers what is left.

    Returns:
        The hull, which contains the object; None if nothing is left.
    """
    poses = np.stack([view.pose for view in views])
    middle = looked_at(poses)
    reach = float(np.linalg.norm(poses[:, :, 3] - middle, axis=1).max())
    low, high = middle - reach, middle + reach
    distances = [_distance(view.mask) for view in views]
    hull = None
    for _ in range(ROUNDS):
        edge = float((high - low).max()) / RESOLUTION
        hull = _carve(views, distances, 0.5 * (low + high) - 0.5 * RESOLUTION * edge, edge)
        if not hull.inside.any():
            return None
        low, high = hull.bounds()
    return hull


def project(
    points: np.ndarray, pose: np.ndarray, intrinsics: np.ndarray, distortion: np.ndarray
) -> tuple[np.ndarray, np.ndarray]:
    """Where points of the world are seen.

    Args:
        points: (N, 3).
        pose, intrinsics, distortion: (3, 4), (4,) and (4,) of the camera, as in `View`.

    Returns:
        (N, 2) column and row [pixels], and (N,) depth along the optical axis, positive in front; float64.
    """
    local = (points - pose[:, 3]) @ pose[:, :3]
    depth = -local[:, 2]
    safe = np.where(depth > 0.0, depth, 1.0)
    ideal = np.stack([local[:, 0] / safe, -local[:, 1] / safe], axis=1)
    return distort(ideal, distortion) * intrinsics[:2] + intrinsics[2:], depth


def looked_at(poses: np.ndarray) -> np.ndarray:
    """The point (3,) nearest to all optical axes of poses (V, 3, 4), camera -> world, in least squares.

    It is among the cameras if the axes are parallel.
    """
    origin, axis = poses[:, :, 3], -poses[:, :, 2]
    across = np.eye(3) - axis[:, :, None] * axis[:, None, :]
    centre = origin.mean(axis=0)
    shift = np.einsum("nij,nj->ni", across, origin - centre).sum(axis=0)
    return centre + np.linalg.lstsq(across.sum(axis=0), shift, rcond=1e-3)[0]


def _distance(mask: np.ndarray) -> tuple[np.ndarray, int]:
    """A lower bound of the distance from every block of pixels to the mask [pixels], and the block's size."""
    block = -(-max(mask.shape) // MASK_SIZE)
    padded = np.pad(mask, [(0, -side % block) for side in mask.shape])
    rows, columns = padded.shape[0] // block, padded.shape[1] // block
    pooled = padded.reshape(rows, block, columns, block).any(axis=(1, 3))
    away = np.asarray(ndimage.distance_transform_edt(~pooled))
    return np.maximum(away - 1.0, 0.0).astype(np.float32) * block, block


def _carve(
    views: Sequence[View], distances: Sequence[tuple[np.ndarray, int]], low: np.ndarray, edge: float
) -> Hull:
    index = np.indices((RESOLUTION,) * 3).reshape(3, -1).T
    centres = low + (index + 0.5) * edge
    alive = np.arange(len(centres))
    coverage = np.zeros(len(centres), np.int32)
    background_votes = np.zeros(len(centres), np.int32)
    count = len(views)
    # Neighbours in a video carve the same voxels: views in random order leave fewer to be looked at.
    for done, k in enumerate(np.random.default_rng(0).permutation(count), start=1):
        distance, stride = distances[k]
        reach = 0.5 * np.sqrt(3.0) * edge
        framed, background = _judged(views[k], distance, stride, centres[alive], reach)
        coverage[alive] += framed
        background_votes[alive] += background
        possible = coverage[alive] + count - done >= COVERAGE * count
        alive = alive[possible & (background_votes[alive] <= DISSENT * count)]
    occupied = np.zeros(len(centres), bool)
    occupied[alive] = True
    return Hull(occupied.reshape((RESOLUTION,) * 3), low, edge)


def _judged(
    view: View, away: np.ndarray, block: int, points: np.ndarray, radius: float
) -> tuple[np.ndarray, np.ndarray]:
    """Which points the view tells of, and around which of those a ball shows background only, (N,) bool each.

    Args:
        view: the camera.
        away: least distances of blocks of pixels from the mask [pixels].
        block: side of a block [pixels].
        points: (N, 3) middles of the balls.
        radius: of the balls, in the points' units.
    """
    height, width = view.mask.shape
    pixels, depth = project(points, view.pose, view.intrinsics, view.distortion)
    framed = (depth > 0.0) & (pixels >= 0.0).all(axis=1) & (pixels < (width, height)).all(axis=1)
    if view.distortion.any():
        framed &= _off_axis(view, points) <= _widest(view)
    column, row = (pixels[framed] // block).astype(np.int64).T
    blurred = radius * view.intrinsics[:2].max() / depth[framed]
    background = np.full(len(points), view.whole)
    background[framed] = away[row, column] > blurred
    return framed | view.whole, background


def _off_axis(view: View, points: np.ndarray) -> np.ndarray:
    """Tangent of the angle between the points in front of a camera and its axis, (N,)."""
    local = (points - view.pose[:, 3]) @ view.pose[:, :3]
    return np.linalg.norm(local[:, :2], axis=1) / np.maximum(-local[:, 2], 1e-12)


def _widest(view: View) -> float:
    """The largest such tangent in the image: beyond, the lens model may fold points back into it."""
    height, width = view.mask.shape
    corners = np.array([(0, 0), (width, 0), (0, height), (width, height)], np.float64)
    ideal = undistort((corners - view.intrinsics[2:]) / view.intrinsics[:2], view.distortion)
    return 1.001 * float(np.linalg.norm(ideal, axis=1).max())
