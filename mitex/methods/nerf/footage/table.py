"""The plane that an object stands on, found among sparse points."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.errors import CaptureError
from mitex.methods.nerf.footage.site import Site

TRIALS = 500  # of RANSAC
TILT = np.cos(np.radians(25.0))  # of the table from level, at most: the horizon of the pictures may slant
TOLERANCE = 0.01  # how far points of the table may lie off it [distances of the cameras]
REACH = 1.0  # how far from the middle the table's points may be [distances]
LEAST = 30  # points of a table


@dataclass(frozen=True, eq=False)
class Plane:
    """Points p with normal . p = offset.

    Attributes:
        normal: (3,) unit, up.
        offset: of the plane along it.
    """

    normal: np.ndarray
    offset: float

    def height(self, points: np.ndarray) -> np.ndarray:
        """How far points (N, 3) are above it, (N,)."""
        return points @ self.normal - self.offset


def find_table(site: Site) -> Plane:
    """The nearly level plane around the middle with the most points (RANSAC, then least squares).

    Raises:
        CaptureError: there is none.
    """
    near = np.linalg.norm(site.points - site.middle, axis=1) < REACH * site.distance
    points, tolerance = site.points[near], TOLERANCE * site.distance
    best = np.zeros(len(points), bool)
    rng = np.random.default_rng(0)
    for _ in range(TRIALS if len(points) >= 3 else 0):
        plane = _through(points[rng.choice(len(points), 3, replace=False)])
        if plane is not None and (on := np.abs(plane.height(points)) < tolerance).sum() > best.sum():
            best = on
    table = _fitted(points[best]) if best.sum() >= LEAST else None
    if table is None:
        raise CaptureError(
            "no table was found under the object",
            "stand it on something flat with a pattern, such as a newspaper, or mask it in another way",
        )
    return table


def _through(corners: np.ndarray) -> Plane | None:
    normal = np.cross(corners[1] - corners[0], corners[2] - corners[0])
    length = float(np.linalg.norm(normal))
    if length < 1e-12:
        return None
    return _level(normal / length, corners.mean(axis=0))


def _fitted(points: np.ndarray) -> Plane | None:
    centre = points.mean(axis=0)
    return _level(np.linalg.svd(points - centre, full_matrices=False)[2][2], centre)


def _level(normal: np.ndarray, through: np.ndarray) -> Plane | None:
    """The plane with its normal up; None if it is far from level."""
    normal = normal * (1.0 if normal[2] > 0.0 else -1.0)
    return Plane(normal, float(normal @ through)) if normal[2] > TILT else None
