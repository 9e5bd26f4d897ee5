"""The light of photos: known lights on a ball, and what can go wrong."""

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
import pytest

from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.training.light_estimate import estimated_light
from tests.methods.nerf.tiny import tiny_capture

RADIUS = 0.55
LEVEL = math.sqrt(4 * math.pi)  # of even radiance 1


@pytest.fixture(scope="module")
def ball() -> Mesh:
    sphere = icosphere(44)
    return Mesh(RADIUS * sphere.vertices, sphere.faces, name="ball")


def photographed(radiance, rng=None) -> Capture:
    """A ball around the origin whose radiance goes with its normals (N, 3) alone, or with noise as well."""
    capture, images = tiny_capture(), []
    for view, image in enumerate(capture.images):
        y, x = np.mgrid[: image.shape[0], : image.shape[1]]
        pixels = np.stack([x.ravel(), y.ravel()], axis=1) + 0.5
        origin, direction = (rays.astype(np.float64) for rays in capture.rays(view, pixels))
        half = (origin * direction).sum(1)
        inside = half**2 - (origin**2).sum(1) + RADIUS**2
        t = -half - np.sqrt(np.maximum(inside, 0))
        linear = radiance((origin + t[:, None] * direction) / RADIUS)
        if rng is not None:
            linear = linear * rng.uniform(0.4, 1.6, len(linear))
        colour = np.round(255 * linear.clip(0, 1) ** (1 / 2.4))
        flat = np.column_stack([colour, colour, colour, 255 * (inside > 0)])
        images.append(flat.reshape(*image.shape).astype(np.uint8))
    return replace(capture, images=tuple(images))


def test_the_light_of_a_grey_ball_is_found(ball):
    """L(w) = 1 + a . w gives k_d (1 + 2/3 a . n) by hand."""
    a = np.array([0.5, -0.3, 0.4])
    light = estimated_light(ball, photographed(lambda n: 0.25 * (1 + 2 / 3 * n @ a)))
    first = math.sqrt(4 * math.pi / 3)
    expected = np.array([LEVEL, -first * a[1], first * a[2], -first * a[0], *[0.0] * 12])
    assert light.shape == (16,) and light.dtype == np.float32
    np.testing.assert_allclose(light, expected, atol=0.02 * LEVEL)


def test_colours_that_do_not_know_the_normals_average_out(ball, rng):
    a = np.array([0.0, 0.6, -0.5])
    capture = photographed(lambda n: 0.25 * (1 + 2 / 3 * n @ a), rng)
    light = estimated_light(ball, capture)
    even = estimated_light(ball, photographed(lambda n: 0.25 + 0 * n[:, 0]))
    expected = math.sqrt(4 * math.pi / 3) * np.array([-0.6, -0.5, 0.0])
    np.testing.assert_allclose(light[1:4], expected, atol=0.06 * LEVEL)
    np.testing.assert_allclose(even, [LEVEL, *[0.0] * 15], atol=0.01 * LEVEL)


@pytest.mark.parametrize("axis", [0, 1, 2])
def test_exposures_that_go_with_the_direction_are_no_light(ball, axis):
    """Photos from one side are up to twice as bright as from the other, half a stop at most from the mean."""
    a = np.array([0.3, -0.2, 0.25])
    capture = photographed(lambda n: 0.2 * (1 + 2 / 3 * n @ a))
    plain = estimated_light(ball, capture)
    places = capture.poses[:, axis, 3] / np.linalg.norm(capture.poses[:, :, 3], axis=1)
    gains = np.exp(0.35 * (places - places.mean()))
    images = [
        np.concatenate([np.round(image[..., :3] * gain ** (1 / 2.4)), image[..., 3:]], axis=2)
        for image, gain in zip(capture.images, gains, strict=True)
    ]
    drifted = replace(capture, images=tuple(image.clip(0, 255).astype(np.uint8) for image in images))
    assert np.abs(estimated_light(ball, drifted) - plain).max() > 0.1 * plain[0]
    np.testing.assert_allclose(estimated_light(ball, drifted, exposures=True), plain, atol=0.03 * plain[0])


def test_no_side_is_darker_than_a_quarter_of_the_mean(ball):
    """Light from one side alone, max(n . z, 0): what is black under it could never get a colour."""
    light = estimated_light(ball, photographed(lambda n: np.maximum(n[:, 2], 0.0)))
    n = icosphere(16).vertices.astype(np.float64)
    x, y, z = n.T
    harmonics = [
        np.full(len(n), math.sqrt(1 / (4 * math.pi))),
        *(math.sqrt(3 / (4 * math.pi)) * axis for axis in (-y, z, -x)),
        *(math.sqrt(15 / (4 * math.pi)) * pair for pair in (x * y, -y * z)),
        math.sqrt(5 / (16 * math.pi)) * (3 * z * z - 1),
        -math.sqrt(15 / (4 * math.pi)) * x * z,
        math.sqrt(15 / (16 * math.pi)) * (x * x - y * y),
    ]
    cosine = np.array([1.0, *[2 / 3] * 3, *[1 / 4] * 5])
    shades = (cosine * light[:9]) @ np.stack(harmonics)
    assert light[2] > 0.2 * light[0]
    assert shades.min() == pytest.approx(0.25 * shades.mean(), rel=0.02)


@pytest.mark.parametrize("exposures", [False, True])
@pytest.mark.parametrize("alpha", [0, 255])
def test_black_photos_and_empty_ones_give_a_dim_even_light(ball, alpha, exposures):
    capture = photographed(lambda n: 0 * n[:, 0])
    for image in capture.images:
        image[..., 3] = np.minimum(image[..., 3], alpha)
    light = estimated_light(ball, capture, exposures)
    assert 0 < light[0] < 1
    assert (light[1:] == 0).all()
