"""Textures on planes at ever flatter angles, beside photos of the surface (Huang et al. 2023, table 2).

The pixels of photos that see the base shape under some angle are the reference. The same camera then sees a
plane that touches the base shape there, with a texture on it. So scale, light and perspective are those of
the photo; only what the texture shows differs. The same pixels count in photos and on planes: a plane shows
the angle in the whole window, and windows in which the photo shows it in few pixels would weigh more.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mitex.colour import linear_to_srgb, srgb_to_linear
from mitex.evaluation.metrics import single_image_frechet
from mitex.evaluation.windows import PLACES, WINDOW, Photos, Rendering, Surface, Window, select_windows
from mitex.mip_map import MipMap

HALF = 1.0  # half the side of the plane [scene units]

Renderer = Callable[[Window], Rendering]  # shows a texture by the rays of a window


@dataclass(frozen=True, eq=False)
class Elevation:
    """Textures under one angle; all distances are `single_image_frechet` from photos.

    Those of `ours` and `flat` are means of several syntheses, and the picture is of the first.

    Attributes:
        angle: between the view and the normal [degrees].
        captured: of the model where it was captured, seen as in the photos: the fit's own distance.
        ours: of the synthesized texture.
        flat: of the flat textures that it is compared with, by name.
        photos: of other photos under this angle: what is the least to be expected.
        picture: (4 S, K S, 3) windows of K photos, below them captured, ours, and the last flat ones.
    """

    angle: float
    captured: float
    ours: float
    flat: dict[str, float]
    photos: float
    picture: np.ndarray


class FlatTexture:
    """Renders an image on the plane of a window.

    Args:
        image: (T, T, 3) sRGB in [0, 1], tileable; row 0 is on top.
        gap: between texels [scene units].
        along: (3,) direction in the scene that its rows follow.
        filtered: pixels show the mean light of what they cover, else the texel in their middle.
        brightness: factor of its sRGB values where it faces a direction (3,) of the scene; 1 if None.
    """

    def __init__(
        self,
        image: np.ndarray,
        gap: float,
        along: np.ndarray,
        filtered: bool = True,
        brightness: Callable[[np.ndarray], float] | None = None,
    ) -> None:
        self.image, self.gap, self.along, self.brightness = image, gap, along, brightness
        self._mip_map = MipMap(srgb_to_linear(image)) if filtered else None

    def __call__(self, window: Window) -> Rendering:
        """The plane as the photo would see it; pixels beside the plane show the window's background."""
        _, origins, directions = window.to_plane(self.along)
        steps = -origins[:, 2:] / directions[:, 2:]
        hits = origins[:, :2] + steps * directions[:, :2]
        valid = (np.abs(hits).max(1) < HALF) & (directions[:, 2] < 0)
        footprints = _footprints(origins, directions, steps, window.mask.shape)
        flip = np.array([1.0, -1.0]) / self.gap  # columns go along x, rows against y
        colours = np.tile(window.background, (len(hits), 1)).astype(np.float64)
        colours[valid] = self._colours(hits[valid] * flip, footprints[valid] * flip[:, None])
        if self.brightness is not None:
            colours[valid] *= self.brightness(window.normal)
        return window.rendering(colours, valid)

    def _colours(self, places: np.ndarray, footprints: np.ndarray) -> np.ndarray:
        """sRGB (N, 3) of pixels; arguments as of `MipMap`."""
        if self._mip_map is not None:
            return linear_to_srgb(self._mip_map(places, footprints))
        column, row = np.floor(places.T).astype(np.int64) % len(self.image)
        return self.image[row, column]


def _footprints(
    origins: np.ndarray, directions: np.ndarray, steps: np.ndarray, shape: tuple[int, ...]
) -> np.ndarray:
    """(N, 2, 2) how hits of rays in the plane z = 0 change (axis 1) to the pixel beside and below (axis 2).

    Where the ends of rays of one length change by c, the hits do by c - d c_z / d_z: ray differentials
    (Igehy 1999).
    """
    changes = []
    for axis in (1, 0):
        origin, direction = (np.gradient(a.reshape(*shape, 3), axis=axis) for a in (origins, directions))
        ends = origin.reshape(-1, 3) + steps * direction.reshape(-1, 3)
        changes.append(ends[:, :2] - directions[:, :2] * (ends[:, 2:] / directions[:, 2:]))
    return np.stack(changes, axis=2)


def elevation_table(
    photos: Photos,
    surfaces: Sequence[Surface],
    captured: Renderer,
    syntheses: Iterable[tuple[Renderer, Mapping[str, Renderer]]],
    *,
    seed: int = 0,
    window: int = WINDOW,
    places: int = PLACES,
) -> list[Elevation]:
    """The table; angles without enough pixels are left out.

    Args:
        photos: of the surface.
        surfaces: of each photo.
        captured: shows the model where it was captured.
        syntheses: of each synthesis, what shows our texture, and flat ones by name, at least one of each:
            chance counts for a lot in a single synthesis.
        seed: of the windows' places.
        window: side of the windows [pixels].
        places: windows for each angle that are rendered; as many again tell how much photos differ.
    """
    windows = select_windows(photos, surfaces, np.random.default_rng(seed), window, places)
    references = [_Reference(angle, *_halves(group), captured) for angle, group in windows.items()]
    tables = [[one.compared(ours, flat) for one in references] for ours, flat in syntheses]
    return [_mean(rows) for rows in zip(*tables, strict=True)]


def plane_distances(windows: Mapping[float, list[Window]], render: Renderer) -> dict[float, float]:
    """How far a texture is from photos, by angle: `single_image_frechet` of the first half of the windows.

    Args:
        windows: of `select_windows`.
        render: shows the texture.
    """
    halves = {angle: _halves(group)[0] for angle, group in windows.items()}
    return {angle: _distance(_strip(list(map(render, half))), half) for angle, half in halves.items()}


def photo_distances(windows: Mapping[float, list[Window]]) -> dict[float, float]:
    """The same of the photos of the second half: what is the least to be expected."""
    halves = {angle: _halves(group) for angle, group in windows.items()}
    return {angle: _distance(_photos(others), first) for angle, (first, others) in halves.items()}


class _Reference:
    """What all syntheses are compared with under one angle, and what does not depend on them.

    Args:
        angle: between the view and the normal [degrees].
        windows: that are rendered.
        others: tell how much photos differ.
        captured: shows the model where it was captured.
    """

    def __init__(self, angle: float, windows: list[Window], others: list[Window], captured: Renderer) -> None:
        self.windows, strip = windows, _strip(list(map(captured, windows)))
        picture = np.concatenate([_photos(windows)[0], strip[0]])
        distances = _distance(strip, windows), _distance(_photos(others), windows)
        self.row = Elevation(angle, distances[0], math.nan, {}, distances[1], picture)

    def compared(self, ours: Renderer, flat: Mapping[str, Renderer]) -> Elevation:
        """The row of a synthesis."""
        strips = [_strip(list(map(render, self.windows))) for render in (ours, *flat.values())]
        of_ours, *of_flat = (_distance(strip, self.windows) for strip in strips)
        picture = np.concatenate([self.row.picture, strips[0][0], strips[-1][0]])
        return replace(self.row, ours=of_ours, flat=dict(zip(flat, of_flat, strict=True)), picture=picture)


def _halves(windows: list[Window]) -> tuple[list[Window], list[Window]]:
    half = (len(windows) + 1) // 2
    return windows[:half], windows[half:]


def _photos(windows: list[Window]) -> Rendering:
    return _strip([(window.photo, window.mask) for window in windows])


def _distance(strip: Rendering, windows: list[Window]) -> float:
    photo, mask = _photos(windows)
    return single_image_frechet(strip[0], photo, mask_a=strip[1], mask_b=mask)


def _mean(rows: Sequence[Elevation]) -> Elevation:
    """One row of the table, of the same angle in several syntheses."""
    flat = {name: float(np.mean([row.flat[name] for row in rows])) for name in rows[0].flat}
    return replace(rows[0], ours=float(np.mean([row.ours for row in rows])), flat=flat)


def _strip(views: list[Rendering]) -> Rendering:
    """Images and masks of one height, side by side."""
    images, masks = zip(*views, strict=True)
    return np.concatenate(images, axis=1), np.concatenate(masks, axis=1)
