"""Windows of photos of a plane, and flat textures seen by their rays, against known answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from mitex.evaluation import elevations
from mitex.evaluation.elevations import FlatTexture, elevation_table
from mitex.evaluation.windows import TOLERANCE, select_windows

SIDE, HEIGHT = 64, 3.0
ALONG = np.array([1.0, 0.0, 0.0])


@dataclass
class Photos:
    """Parallel rays onto the plane z = 0 under an angle, in which the plane shows an image."""

    images: list[np.ndarray]
    angles: list[float]

    def rays(self, view, pixels):
        angle = np.radians(self.angles[view])
        direction = np.array([0.0, np.sin(angle), -np.cos(angle)])
        places = (pixels - SIDE / 2) / SIDE
        points = np.column_stack([places[:, 0], -places[:, 1] / np.cos(angle), np.zeros(len(places))])
        origins = points - HEIGHT * direction
        return origins.astype(np.float32), np.tile(direction, (len(pixels), 1)).astype(np.float32)


@dataclass
class Surface:
    angle: np.ndarray
    points: np.ndarray
    normals: np.ndarray


def scene(angles, seed=0):
    rng = np.random.default_rng(seed)
    images = [rng.integers(0, 255, (SIDE, SIDE, 4), np.uint8) for _ in angles]
    for image in images:
        image[..., 3] = 255
    photos = Photos(images, list(angles))
    y, x = np.mgrid[:SIDE, :SIDE] + 0.5
    surfaces = []
    for view, angle in enumerate(angles):
        origins, directions = photos.rays(view, np.column_stack([x.ravel(), y.ravel()]))
        points = (origins + HEIGHT * directions).reshape(SIDE, SIDE, 3)
        normals = np.broadcast_to(np.array([0.0, 0.0, 1.0]), points.shape)
        surfaces.append(Surface(np.full((SIDE, SIDE), angle), points, normals))
    return photos, surfaces


def test_windows_are_those_of_their_angle():
    photos, surfaces = scene([0, 4, 20, 24, 41, 90, 90])
    windows = select_windows(photos, surfaces, np.random.default_rng(0), 32, 8)
    assert list(windows) == [0, 20]  # a single one at 40 degrees is too few
    for angle, group in windows.items():
        for window in group:
            cosine = -window.directions @ window.normal
            assert (np.abs(np.degrees(np.arccos(cosine)) - angle) < TOLERANCE).all()
            assert window.mask.all() and window.photo.shape == (32, 32, 3)


def test_opaque_pixels_count_alone():
    photos, surfaces = scene([0, 0])
    for image in photos.images:
        image[:, ::2, 3] = 0
    windows = select_windows(photos, surfaces, np.random.default_rng(0), 32, 8)[0]
    assert all(window.mask.mean() == 0.5 for window in windows)


@pytest.mark.parametrize("angle", [0, 40])
def test_a_flat_texture_shows_the_texels_that_the_rays_meet(angle):
    photos, surfaces = scene([angle, angle])
    rng = np.random.default_rng(1)
    image, gap = rng.uniform(size=(20, 20, 3)).astype(np.float32), 0.05
    for window in select_windows(photos, surfaces, rng, 32, 8)[angle]:
        colours, valid = FlatTexture(image, gap, ALONG, filtered=False)(window)
        steps = -window.origins[:, 2] / window.directions[:, 2]
        hits = (window.origins + steps[:, None] * window.directions)[:, :2] - window.point[:2] + window.shift
        inner = (np.abs(hits / gap - np.round(hits / gap)) > 1e-3).all(1)  # not between two texels
        texel = np.floor(hits / gap).astype(int)
        expected = image[(-texel[:, 1] - 1) % 20, texel[:, 0] % 20]
        on = inner & valid.ravel()
        assert on.mean() > 0.5
        np.testing.assert_allclose(colours.reshape(-1, 3)[on], expected[on], atol=1e-6)


class PinholePhotos(Photos):
    """The same from a point."""

    def rays(self, view, pixels):
        origins, directions = super().rays(view, pixels)
        eye = origins.mean(0)
        directions = origins + HEIGHT * directions - eye
        directions /= np.linalg.norm(directions, axis=1, keepdims=True)
        return np.broadcast_to(eye, origins.shape).astype(np.float32), directions.astype(np.float32)


@pytest.mark.parametrize("kind", [Photos, PinholePhotos])
@pytest.mark.parametrize("angle", [0, 40])
def test_pixels_are_filtered_over_what_they_cover(kind, angle, monkeypatch):
    """Footprints are the distances of the hits of pixels side by side, in texels."""
    photos, surfaces = scene([angle, angle])
    photos = kind(photos.images, photos.angles)
    image, gap, lookups = np.zeros((20, 20, 3), np.float32), 0.05, []

    def lookup(places, footprints):
        lookups.append((places, footprints))
        return np.zeros((len(places), 3))

    monkeypatch.setattr(elevations, "MipMap", lambda image: lookup)
    for window in select_windows(photos, surfaces, np.random.default_rng(1), 32, 8)[angle]:
        lookups.clear()
        valid = FlatTexture(image, gap, ALONG)(window)[1]
        ((places, footprints),) = lookups
        assert valid.all()
        grid = places.reshape(32, 32, 2)
        expected = np.stack([np.gradient(grid, axis=1), np.gradient(grid, axis=0)], axis=-1)
        inner = (slice(1, -1), slice(1, -1))
        actual = footprints.reshape(32, 32, 2, 2)
        np.testing.assert_allclose(actual[inner], expected[inner], atol=1e-3 * np.abs(expected).max())
        assert np.abs(expected).max() > 0.1


def test_a_checkerboard_that_no_pixel_resolves_shows_its_mean_light():
    """Half of the light is 0.735 in sRGB, not 0.5."""
    photos, surfaces = scene([40, 40])
    rows, columns = np.mgrid[:64, :64]
    image = np.repeat(((rows + columns) % 2)[..., None], 3, axis=2).astype(np.float32)
    for window in select_windows(photos, surfaces, np.random.default_rng(1), 32, 8)[40]:
        colours, valid = FlatTexture(image, 1 / SIDE / 8, ALONG)(window)
        np.testing.assert_allclose(colours[valid], 0.7354, atol=1e-3)
        raw, _ = FlatTexture(image, 1 / SIDE / 8, ALONG, filtered=False)(window)
        assert set(np.unique(raw[valid])) <= {0.0, 1.0}


def test_texels_as_large_as_many_pixels_stay_as_they_are(rng):
    photos, surfaces = scene([0, 0])
    image, gap = rng.uniform(size=(4, 4, 3)).astype(np.float32), 16 / SIDE
    for window in select_windows(photos, surfaces, rng, 32, 8)[0]:
        filtered, raw = (FlatTexture(image, gap, ALONG, on)(window)[0] for on in (True, False))
        assert np.abs(filtered - raw).min(axis=(0, 1)).max() < 0.03  # in the middles of texels
        assert filtered.min() >= image.min() - 1e-6 and filtered.max() <= image.max() + 1e-6


def test_a_flat_texture_is_as_bright_as_its_side_is():
    photos, surfaces = scene([20, 20])
    image = np.full((8, 8, 3), 0.5, np.float32)
    for window in select_windows(photos, surfaces, np.random.default_rng(1), 32, 8)[20]:
        texture = FlatTexture(image, 0.05, ALONG, brightness=lambda normal: 1.0 + 0.5 * normal[2])
        colours, valid = texture(window)
        np.testing.assert_allclose(colours[valid], 0.75, atol=1e-6)


def test_the_table_compares_renderings_with_photos():
    """What shows the photo itself has no distance; two syntheses are averaged."""
    photos, surfaces = scene([0, 0, 0, 0, 20, 20])

    def exact(window):
        return window.rendering(window.photo.reshape(-1, 3))

    def inverse(window):
        return window.rendering(1 - window.photo.reshape(-1, 3))

    def grey(window):
        return window.rendering(np.full((window.mask.size, 3), 0.5))

    flat = {"inverse": inverse, "grey": grey}
    pairs = [(grey, flat), (exact, flat)]
    table = elevation_table(photos, surfaces, exact, pairs, window=32, places=2)
    assert [row.angle for row in table] == [0, 20]
    for row, (first,) in zip(
        table, zip(elevation_table(photos, surfaces, exact, pairs[:1], window=32, places=2)), strict=True
    ):
        assert row.captured == pytest.approx(0, abs=1e-3) and row.flat == pytest.approx(first.flat)
        assert list(row.flat) == ["inverse", "grey"] and row.flat["grey"] == pytest.approx(first.ours)
        assert row.ours == pytest.approx(first.ours / 2, rel=1e-2) and row.ours > 1e-2
        assert row.picture.shape[0] == 4 * 32 and (row.picture[96:] == 0.5).all()  # the last flat one
