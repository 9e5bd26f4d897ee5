"""Windows of photos of a plane, and flat textures seen by their rays, against known answers."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

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
        colours, valid = FlatTexture(image, gap, ALONG)(window)
        steps = -window.origins[:, 2] / window.directions[:, 2]
        hits = (window.origins + steps[:, None] * window.directions)[:, :2] - window.point[:2] + window.shift
        inner = (np.abs(hits / gap - np.round(hits / gap)) > 1e-3).all(1)  # not between two texels
        texel = np.floor(hits / gap).astype(int)
        expected = image[(-texel[:, 1] - 1) % 20, texel[:, 0] % 20]
        on = inner & valid.ravel()
        assert on.mean() > 0.5
        np.testing.assert_allclose(colours.reshape(-1, 3)[on], expected[on], atol=1e-6)


def test_the_table_compares_renderings_with_photos():
    """What shows the photo itself has no distance; two syntheses are averaged."""
    photos, surfaces = scene([0, 0, 0, 0, 20, 20])

    def exact(window):
        return window.rendering(window.photo.reshape(-1, 3))

    def inverse(window):
        return window.rendering(1 - window.photo.reshape(-1, 3))

    def grey(window):
        return window.rendering(np.full((window.mask.size, 3), 0.5))

    pairs = [(grey, inverse), (exact, inverse)]
    table = elevation_table(photos, surfaces, exact, pairs, window=32, places=2)
    assert [row.angle for row in table] == [0, 20]
    for row, (first,) in zip(
        table, zip(elevation_table(photos, surfaces, exact, pairs[:1], window=32, places=2)), strict=True
    ):
        assert row.captured == pytest.approx(0, abs=1e-3) and row.flat == pytest.approx(first.flat)
        assert row.ours == pytest.approx(first.ours / 2, rel=1e-2) and row.ours > 1e-2
        assert row.picture.shape[0] == 4 * 32
