"""Windows of photos in which a surface is seen under given angles."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Protocol

import numpy as np

from mitex.geometry.vectors import orthonormal

ELEVATIONS = (0, 20, 40, 60, 80)  # between view and normal, as in table 2 [degrees]
TOLERANCE = 10.0  # pixels count if their angle is nearer than this to the elevation [degrees]
WINDOW = 96  # side of a window of a photo [pixels]
PLACES = 24  # for each angle
LEAST = 100  # windows with fewer pixels that count are left out
SHIFT = 0.5  # of the window on the plane, at most, so that each shows another part of the texture
SOLID = 0.5  # opacity of pixels that count

Rendering = tuple[np.ndarray, np.ndarray]  # an image (H, W, 3), and which of its pixels count (H, W)


class Photos(Protocol):
    """Photos with known cameras.

    Attributes:
        images: (H, W, 4) uint8 each, sRGB with straight alpha.
    """

    @property
    def images(self) -> Sequence[np.ndarray]: ...

    def rays(self, view: int, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Origins and unit directions (P, 3) of rays through positions (P, 2), column and row [pixels]."""
        ...


class Surface(Protocol):
    """Where the rays of a photo's pixels (H, W) meet the base shape.

    Attributes:
        angle: between the ray and the normal, 180 where the mesh is missed [degrees].
        points, normals: (H, W, 3) of the mesh, normals of length 1.
    """

    @property
    def angle(self) -> np.ndarray: ...

    @property
    def points(self) -> np.ndarray: ...

    @property
    def normals(self) -> np.ndarray: ...


@dataclass(frozen=True, eq=False)
class Window:
    """A window of a photo around a pixel that sees the base shape under an angle.

    Attributes:
        photo: (S, S, 3) sRGB in [0, 1] on its background.
        background: (3,) mean colour of what is opaque, lest the border of the object count as texture.
        mask: (S, S) bool, pixels that count.
        origins, directions: (S * S, 3) of its rays.
        point, normal: (3,) where the middle one meets the base shape, and its normal there.
        shift: (2,) of the middle on the plane.
    """

    photo: np.ndarray
    background: np.ndarray
    mask: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    shift: np.ndarray

    def to_plane(self, along: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The rays in the axes of the tangent plane, z upwards.

        Args:
            along: (3,) direction in the scene that the plane's x follows.

        Returns:
            (3, 3) rotation of the scene into the plane's axes, origins and directions (S * S, 3) there.
        """
        n = self.normal[None].astype(np.float32)
        t = orthonormal(along[None].astype(np.float32), n)
        turn = np.concatenate([t, np.cross(n, t), n]).astype(np.float64)
        origins = (self.origins - self.point) @ turn.T
        origins[:, :2] += self.shift
        return turn, origins, self.directions @ turn.T

    def rendering(self, colours: np.ndarray, valid: np.ndarray | None = None) -> Rendering:
        """A rendering of colours (S * S, 3); pixels that are not `valid` (S * S) do not count."""
        shape = self.mask.shape
        mask = self.mask if valid is None else self.mask & valid.reshape(shape)
        return colours.clip(0, 1).astype(np.float32).reshape(*shape, 3), mask


def select_windows(
    photos: Photos, surfaces: Sequence[Surface], rng: np.random.Generator, side: int, places: int
) -> dict[float, list[Window]]:
    """Windows of photos by angle, at least two for each; angles without enough pixels are left out.

    Args:
        photos, surfaces: the photos, and where their rays meet the base shape.
        rng: of the places.
        side: of the windows [pixels].
        places: half of the windows for each angle, at most.
    """
    windows: dict[float, list[Window]] = {}
    for angle in ELEVATIONS:
        group = []
        for view in rng.permutation(len(surfaces)).tolist():
            window = _window(photos, view, surfaces[view], angle, side, rng)
            group += [] if window is None else [window]
        if len(group) >= 2:
            windows[angle] = group[: 2 * places]
    return windows


def _window(
    photos: Photos, view: int, surface: Surface, angle: float, side: int, rng: np.random.Generator
) -> Window | None:
    """Somewhere in a view, or None if too few pixels see the surface under the angle."""
    image = photos.images[view].astype(np.float32) / 255
    half = side // 2
    near = (np.abs(surface.angle - angle) < TOLERANCE) & (image[..., 3] > SOLID)
    inner = (np.abs(surface.angle - angle) < TOLERANCE / 2) & near
    rows, columns = np.nonzero(inner[half : -half or None, half : -half or None])
    if not len(rows):
        return None
    index = rng.integers(len(rows))
    top, left = int(rows[index]), int(columns[index])
    window = slice(top, top + side), slice(left, left + side)
    mask = near[window]
    if mask.shape != (side, side) or mask.sum() < LEAST:
        return None
    colour, alpha = image[window][..., :3], image[window][..., 3:]
    y, x = np.mgrid[window]
    origins, directions = photos.rays(view, np.stack([x.ravel(), y.ravel()], axis=1) + 0.5)
    point, normal = (values[top + half, left + half] for values in (surface.points, surface.normals))
    shift = rng.uniform(-SHIFT, SHIFT, 2)
    background = (colour * alpha).sum((0, 1)) / alpha.sum()
    photo = colour * alpha + background * (1 - alpha)
    return Window(photo, background, mask, origins, directions, point, normal, shift)
