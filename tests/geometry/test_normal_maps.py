"""Normal maps encoded and decoded in frames as skewed as interpolated ones."""

import numpy as np

from mitex.geometry.normal_maps import (
    MIN_Z,
    decode,
    decode_at_vertices,
    encode,
    of_slopes,
    rotated,
    slope_agreement,
    slopes,
)
from mitex.geometry.vectors import orthonormal, unit


def random_frames(rng, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit but skewed, as interpolated ones are."""
    normal = unit(rng.normal(size=(count, 3)))
    tangent = orthonormal(rng.normal(size=(count, 3)), normal)
    skew = 0.1 * rng.normal(size=(2, count, 3))
    bitangent = np.cross(normal, tangent) * rng.choice([-1.0, 1.0], (count, 1))
    return unit(tangent + skew[0]), unit(bitangent + skew[1]), normal


def test_decode_inverts_encode(rng):
    frame = random_frames(rng, 500)
    detail = unit(unit(rng.normal(size=(500, 3))) + 1.6 * frame[2])
    encoded = encode(detail, *frame)
    assert encoded.min() >= 0 and encoded.max() <= 1
    np.testing.assert_allclose(decode(encoded, *frame), detail, atol=2e-6)


def test_rotated_normals_are_those_of_rotated_axes(rng):
    t, b, n = np.eye(3)[:, None].repeat(500, 1)
    encoded = encode(unit(rng.normal(size=(500, 3)) + [0, 0, 2]), t, b, n)
    angle = rng.uniform(-np.pi, np.pi, 500)
    cosine, sine = np.cos(angle)[:, None], np.sin(angle)[:, None]
    expected = decode(encoded, cosine * t + sine * b, cosine * b - sine * t, n)
    np.testing.assert_allclose(decode(rotated(encoded, angle), t, b, n), expected, atol=1e-6)


def test_eight_bits_cost_less_than_a_degree(rng):
    frame = random_frames(rng, 500)
    detail = unit(unit(rng.normal(size=(500, 3))) + 1.6 * frame[2])
    rounded = np.round(encode(detail, *frame) * 255) / 255
    cosine = (decode(rounded, *frame) * detail).sum(axis=1)
    assert np.degrees(np.arccos(cosine.min())) < 1.0


def test_normals_below_the_surface_are_lifted():
    x, y, z = np.eye(3)[:, None]
    encoded = encode(np.array([[1.0, 0.0, -1.0]]), x, y, z)
    assert 0.5 + 0.5 * 0.9 * MIN_Z < encoded[0, 2] < 0.5 + MIN_Z
    assert encoded[0, 0] > 0.99


def test_a_collapsed_frame_gives_the_even_normal():
    x, _, z = np.eye(3)[:, None]
    np.testing.assert_allclose(encode(z, x, x, z), [[0.5, 0.5, 1.0]], atol=0.03)


def test_detail_at_vertices_leans_where_the_map_says():
    normals, east = np.tile([0.0, 0.0, 1.0], (2, 1)), np.tile([1.0, 0.0, 0.0], (2, 1))
    encoded = 0.5 + 0.5 * np.array([[0.6, 0.0, 0.8], [0.0, 0.6, 0.8]])
    detail = decode_at_vertices(encoded, east, normals)
    np.testing.assert_allclose(detail, [[0.6, 0, 0.8], [0, 0.6, 0.8]], atol=1e-6)


def test_slopes_of_a_height_agree(rng):
    height = np.zeros((64, 64))
    x, y = np.meshgrid(np.arange(64), -np.arange(64))  # y is up
    for k, m, phase in rng.integers(1, 6, (6, 3)):
        height += np.sin(2 * np.pi * (k * x + m * y) / 64 + phase) + np.sin(2 * np.pi * (k * x - m * y) / 64)
    down, right = np.array(np.gradient(height))
    normal = unit(np.dstack([-right, down, np.ones((64, 64))]))
    encoded = 0.5 + 0.5 * normal
    agreement = slope_agreement(encoded)
    assert agreement.upward > 0.95 and abs(agreement.across) < 0.6
    flipped, exchanged = encoded * [1, -1, 1] + [0, 1, 0], encoded[..., [1, 0, 2]]
    assert slope_agreement(flipped).upward == -agreement.upward and slope_agreement(flipped).downward
    assert slope_agreement(exchanged).across == agreement.upward and slope_agreement(exchanged).exchanged
    flat = slope_agreement(np.full((16, 16, 3), 0.5))
    assert not flat.downward and not flat.exchanged


def test_slopes_and_back():
    rises = np.random.default_rng(5).uniform(-2, 2, (4, 5, 2))
    encoded = of_slopes(rises)
    np.testing.assert_allclose(slopes(encoded), rises, atol=1e-5)
    # To the right of a ramp that rises by 1 a unit, the normal leans back by 45 degrees.
    np.testing.assert_allclose(of_slopes(np.array([1.0, 0.0])), [0.5 - 0.5**1.5, 0.5, 0.5 + 0.5**1.5])
