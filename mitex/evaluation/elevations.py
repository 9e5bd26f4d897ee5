"""Textures on planes at ever flatter angles, beside photos of the surface (Huang et al. 2023, table 2).

The pixels of photos that see the base shape under some angle are the reference. The same camera then sees a
plane that touches the base shape there, with a texture on it. So scale, light and perspective are those of
the photo; only what the texture shows differs. The same pixels count in all, or windows of which few pixels
see the angle, and their light, would weigh more on planes than in photos.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass, replace

import numpy as np

from mitex.evaluation.metrics import single_image_frechet
from mitex.evaluation.windows import PLACES, WINDOW, Photos, Rendering, Surface, Window, select_windows

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
        flat: of the flat texture that it is compared with.
        photos: of other photos under this angle: what is the least to be expected.
        picture: (4 S, K S, 3) windows of K photos, below them captured, ours, and flat ones.
    """

    angle: float
    captured: float
    ours: float
    flat: float
    photos: float
    picture: np.ndarray


class FlatTexture:
    """Renders an image on the plane of a window.

    Args:
        image: (T, T, 3) sRGB in [0, 1], tileable; row 0 is on top.
        gap: between texels [scene units].
        along: (3,) direction in the scene that its rows follow.
    """

    def __init__(self, image: np.ndarray, gap: float, along: np.ndarray) -> None:
        self.image, self.gap, self.along = image, gap, along

    def __call__(self, window: Window) -> Rendering:
        _, origins, directions = window.to_plane(self.along)
        hits = origins[:, :2] - directions[:, :2] * (origins[:, 2:] / directions[:, 2:])
        size = len(self.image)
        column, row = (np.floor(v / self.gap).astype(int) % size for v in (hits[:, 0], -hits[:, 1]))
        valid = (np.abs(hits).max(1) < HALF) & (directions[:, 2] < 0)
        colours = np.where(valid[:, None], self.image[row, column], window.background)
        return window.rendering(colours, valid)


def elevation_table(
    photos: Photos,
    surfaces: Sequence[Surface],
    captured: Renderer,
    syntheses: Iterable[tuple[Renderer, Renderer]],
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
        syntheses: of each synthesis, what shows our texture and a flat one, at least one pair: chance counts
            for a lot in a single one.
        seed: of the windows' places.
        window: side of the windows [pixels].
        places: windows for each angle that are rendered; as many again tell how much photos differ.
    """
    windows = select_windows(photos, surfaces, np.random.default_rng(seed), window, places)
    tables = []
    for ours, flat in syntheses:
        tables.append([_compare(group, angle, (captured, ours, flat)) for angle, group in windows.items()])
    return [_mean(rows) for rows in zip(*tables, strict=True)]


def _compare(windows: list[Window], angle: float, renderers: Sequence[Renderer]) -> Elevation:
    """The first half of the windows is rendered, the other one tells how much photos differ."""
    half = (len(windows) + 1) // 2
    first, others = windows[:half], windows[half:]
    photo, mask = _strip([(window.photo, window.mask) for window in first])
    strips = [_strip(list(map(render, first))) for render in renderers]
    strips.append(_strip([(window.photo, window.mask) for window in others]))
    distances = [single_image_frechet(image, photo, mask_a=on, mask_b=mask) for image, on in strips]
    captured, ours, flat, photos = distances
    picture = np.concatenate([photo, *(image for image, _ in strips[:3])])
    return Elevation(angle, captured, ours, flat, photos, picture)


def _mean(rows: Sequence[Elevation]) -> Elevation:
    """Of several syntheses."""
    ours, flat = (float(np.mean([getattr(row, name) for row in rows])) for name in ("ours", "flat"))
    return replace(rows[0], ours=ours, flat=flat)


def _strip(views: list[Rendering]) -> Rendering:
    """Side by side."""
    images, masks = zip(*views, strict=True)
    return np.concatenate(images, axis=1), np.concatenate(masks, axis=1)
