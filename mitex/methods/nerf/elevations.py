"""Synthesized textures seen ever flatter, beside photos of the surface (section 4.3, table 2).

A photo's pixels that see the base shape under some angle are the truth. The same camera then sees a plane
that touches the base shape there, with the radiance-field texture or with a quilted picture on it. So scale,
light and perspective are those of the photo; only what the texture shows differs. The same pixels count in
all, or windows of which few pixels see the angle, and their light, would weigh more on planes than in photos.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mitex.frames import orthonormal
from mitex.mesh import grid
from mitex.methods.baselines.quilted import quilted_albedo
from mitex.methods.nerf.applied import EXTENT
from mitex.methods.nerf.capture import Capture
from mitex.methods.nerf.lighting import rotated
from mitex.methods.nerf.maps import LatentMaps
from mitex.methods.nerf.patches import principal_direction
from mitex.methods.nerf.pictures import pictured
from mitex.methods.nerf.radiance import seen
from mitex.methods.nerf.sights import Sight, Sights, window_rays
from mitex.methods.nerf.texture import NerfTexture
from mitex.metrics import single_image_frechet
from mitex.runtime.jit import mi

ELEVATIONS = (0, 20, 40, 60, 80)
NEAR = 10.0  # pixels count whose angle is so near to the wanted one [degrees]
WINDOW = 96  # side of what is cut out of a photo [pixels]
PLACES = 24  # for each angle
LEAST = 100  # pixels that count, or a place is left out
SYNTHESES = 3
HALF = 1.0  # half the side of the plane [scene units]
SHIFT = 0.5  # of the place on the plane, at most, so that each sees another part of the texture
SOLID = 0.5  # opacity of pixels that count


@dataclass(frozen=True, eq=False)
class Elevation:
    """Textures seen under one angle; all distances are `single_image_frechet` from photos.

    Those of `ours` and `flat` are means of several syntheses, and the picture is of the first.

    Attributes:
        angle: between the view and the normal [degrees].
        captured: of the radiance field where it was captured, seen as in the photos: the fit's own distance.
        ours: of the synthesized radiance-field texture.
        flat: of the quilted picture.
        photos: of other photos under this angle: what is the least to be expected.
        picture: (4 S, K S, 3) windows of K photos, below them captured, ours, and flat ones.
    """

    angle: float
    captured: float
    ours: float
    flat: float
    photos: float
    picture: np.ndarray


def compare_elevations(
    texture: NerfTexture,
    capture: Capture,
    *,
    size: int = 1024,
    patches: int = 2000,
    seed: int = 0,
    window: int = WINDOW,
    places: int = PLACES,
    syntheses: int = SYNTHESES,
) -> list[Elevation]:
    """Table 2 for a texture and its photos; angles without enough pixels are left out.

    Args:
        texture: of `capture`.
        capture: photos.
        size: of both synthesized textures [texels].
        patches: that both are made of, at most.
        seed: of all choices.
        window: side of what is cut out of the photos [pixels].
        places: photos for each angle that are shown; as many again tell how much photos differ.
        syntheses: of each texture, by seeds from `seed` on: chance counts for a lot in a single one.
    """
    capture = capture.within(texture.similarity)
    rng = np.random.default_rng(seed)
    look = Sights(texture.model.base.mesh, capture)
    sights = [look(view) for view in range(len(capture))]
    shown: dict[float, list[_Place]] = {}
    for angle in ELEVATIONS:
        found = []
        for view in rng.permutation(len(capture)).tolist():
            place = _place(capture, view, sights[view], angle, window, rng)
            found += [] if place is None else [place]
        if len(found) >= 2:
            shown[angle] = found[: 2 * places]
    squares = texture.patches(np.random.default_rng(seed), patches)
    pictures = pictured(texture.shell, squares)  # which takes longer than all else
    tables = []
    for each in range(seed, seed + syntheses):
        maps = texture.synthesize(size, each, patches=patches, tileable=True)
        drawn = np.random.default_rng(each)
        flat = quilted_albedo(squares, pictures, (size, size), drawn, tileable=True)
        pair = _Pair(texture, maps, flat)
        tables.append([_compared(found, angle, pair) for angle, found in shown.items()])
    return [_mean(rows) for rows in zip(*tables, strict=True)]


@dataclass(frozen=True, eq=False)
class _Place:
    """A window of a photo around a pixel that sees the base shape under an angle.

    Attributes:
        photo: (S, S, 3) on its background.
        background: (3,) mean colour of what is opaque, lest the border of the object count as texture.
        mask: (S, S) bool, pixels that count.
        origins, directions: (S * S, 3) of its rays.
        point, normal: (3,) where the middle one meets the base shape, and its normal there.
        shift: (2,) where on the plane that is.
    """

    photo: np.ndarray
    background: np.ndarray
    mask: np.ndarray
    origins: np.ndarray
    directions: np.ndarray
    point: np.ndarray
    normal: np.ndarray
    shift: np.ndarray


Strip = tuple[np.ndarray, np.ndarray]  # a picture, and which of its pixels count


def _compared(found: list[_Place], angle: float, pair: _Pair) -> Elevation:
    """The first half of the places is shown on planes, the other one tells how much photos differ."""
    half = (len(found) + 1) // 2
    shown, others = found[:half], found[half:]
    photo, mask = _strip([(place.photo, place.mask) for place in shown])
    strips = [_strip(list(map(look, shown))) for look in (pair.captured, pair.ours, pair.flat)]
    strips.append(_strip([(place.photo, place.mask) for place in others]))
    distances = [single_image_frechet(image, photo, mask_a=on, mask_b=mask) for image, on in strips]
    captured, ours, flat, photos = distances
    picture = np.concatenate([photo, *(image for image, _ in strips[:3])])
    return Elevation(angle, captured, ours, flat, photos, picture)


def _mean(rows: Sequence[Elevation]) -> Elevation:
    """Of several syntheses."""
    ours, flat = (float(np.mean([getattr(row, name) for row in rows])) for name in ("ours", "flat"))
    return replace(rows[0], ours=ours, flat=flat)


def _strip(windows: list[Strip]) -> Strip:
    """Side by side."""
    images, masks = zip(*windows, strict=True)
    return np.concatenate(images, axis=1), np.concatenate(masks, axis=1)


def _place(
    capture: Capture, view: int, sight: Sight, angle: float, side: int, rng: np.random.Generator
) -> _Place | None:
    """Somewhere in a view, or None if too little is seen under the angle."""
    image = capture.images[view].astype(np.float32) / 255
    half = side // 2
    near = (np.abs(sight.angle - angle) < NEAR) & (image[..., 3] > SOLID)
    inner = (np.abs(sight.angle - angle) < NEAR / 2) & near
    rows, columns = np.nonzero(inner[half : -half or None, half : -half or None])
    if not len(rows):
        return None
    chosen = rng.integers(len(rows))
    top, left = int(rows[chosen]), int(columns[chosen])
    window = slice(top, top + side), slice(left, left + side)
    mask = near[window]
    if mask.shape != (side, side) or mask.sum() < LEAST:
        return None
    colour, alpha = image[window][..., :3], image[window][..., 3:]
    origins, directions = window_rays(capture, view, window)
    point, normal = (values[top + half, left + half] for values in (sight.points, sight.normals))
    shift = rng.uniform(-SHIFT, SHIFT, 2)
    background = (colour * alpha).sum((0, 1)) / alpha.sum()
    photo = colour * alpha + background * (1 - alpha)
    return _Place(photo, background, mask, origins, directions, point, normal, shift)


class _Pair:
    """The two textures on a plane, seen by the cameras of photos."""

    def __init__(self, texture: NerfTexture, maps: LatentMaps, image: np.ndarray) -> None:
        self.texture = texture
        self.light = np.array(texture.light)
        self.along = principal_direction(texture.model.base.mesh)
        self.gap, self.image = maps.gap, image
        plane = grid(96, 96)
        scale = EXTENT / HALF
        self.field = texture.apply(plane.with_vertices(HALF * plane.vertices), maps, scale=scale, lift=0.0)

    def captured(self, place: _Place) -> Strip:
        """What was captured, and which pixels count."""
        colour, through = seen(self.texture.shell, place.origins, place.directions)
        return self._window(place, colour + through[:, None] * place.background)

    def ours(self, place: _Place) -> Strip:
        """The field's picture and which pixels count."""
        turn, origins, directions = self._local(place)
        self.field.light = mi.TensorXf(rotated(self.light, turn))
        origins = self.field.similarity.apply(origins)
        colour, through = seen(self.field, origins.astype(np.float32), directions.astype(np.float32))
        return self._window(place, colour + through[:, None] * place.background, 1 - through > SOLID)

    def flat(self, place: _Place) -> Strip:
        """The quilted picture's and which pixels count."""
        _, origins, directions = self._local(place)
        met = origins[:, :2] - directions[:, :2] * (origins[:, 2:] / directions[:, 2:])
        size = len(self.image)
        column, row = (np.floor(v / self.gap).astype(int) % size for v in (met[:, 0], -met[:, 1]))
        on = (np.abs(met).max(1) < HALF) & (directions[:, 2] < 0)
        return self._window(place, np.where(on[:, None], self.image[row, column], place.background), on)

    def _local(self, place: _Place) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The scene's axes to the plane's, and the rays in the latter."""
        n = place.normal[None].astype(np.float32)
        t = orthonormal(self.along[None].astype(np.float32), n)
        turn = np.concatenate([t, np.cross(n, t), n]).astype(np.float64)
        origins = (place.origins - place.point) @ turn.T
        origins[:, :2] += place.shift
        return turn, origins, place.directions @ turn.T

    @staticmethod
    def _window(place: _Place, colours: np.ndarray, on: np.ndarray | None = None) -> Strip:
        """Of the photo's pixels those count that are on the plane."""
        shape = place.mask.shape
        mask = place.mask if on is None else place.mask & on.reshape(shape)
        return colours.clip(0, 1).astype(np.float32).reshape(*shape, 3), mask
