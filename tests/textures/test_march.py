"""Marching: analytic slabs and balls, derivatives, and what is skipped."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.textures.march import FRONT, OPAQUE, Samples, composite, march, sum_rays, visible, weights_of

init()


class Slab:
    """Density and colour between x = -0.5 and 0.5."""

    def __init__(self, density: float, step: float, side: int = 16, colour=(0.2, 0.5, 0.8)) -> None:
        self.density, self.colour, self.step = mi.Float(density), mi.Color3f(*colour), step
        where = np.abs((np.arange(side) + 0.5) * 2 / side - 1) < 0.5
        self.mask = upload(mi.TensorXu8, np.broadcast_to(where[:, None, None], (side,) * 3).astype(np.uint8))
        self.evaluated = 0

    def evaluate(self, points, view):
        self.evaluated += dr.width(points)
        index = mi.UInt32(dr.compress(dr.abs(points.x) < 0.5))
        width = dr.width(index)
        return index, self.density + dr.zeros(mi.Float, width), self.colour + dr.zeros(mi.Color3f, width)


def rays(count: int, slope: float = 0.0):
    """From x = -2 on, through the cube."""
    y = np.linspace(-0.3, 0.3, count)
    direction = np.array([1.0, slope, 0.0]) / math.hypot(1, slope)
    origin = mi.Point3f(np.stack([np.full(count, -2.0), y, np.zeros(count)]).astype(np.float32))
    return (
        origin,
        mi.Vector3f(*direction.tolist()) + dr.zeros(mi.Vector3f, count),
        dr.full(mi.Float, 0.5, count),
    )


@pytest.mark.parametrize("density, slope", [(0.7, 0.0), (3.0, 0.2), (40.0, 0.1)])
def test_a_slab_lets_pass_what_beer_says(density, slope):
    slab = Slab(density, step=1 / 512)
    pixels = composite(slab, *rays(5, slope))
    passes = math.exp(-density * math.hypot(1, slope))
    np.testing.assert_allclose(np.array(pixels.transmittance), passes, atol=2e-3)
    expected = np.outer((1 - passes) * np.ones(5), [0.2, 0.5, 0.8])
    np.testing.assert_allclose(np.array(pixels.colour).T, expected, atol=2e-3)


def test_the_depth_is_that_of_what_was_met():
    pixels = composite(Slab(500.0, step=1 / 1024), *rays(3))
    np.testing.assert_allclose(np.array(pixels.depth), 1.5, atol=5e-3)


def test_what_is_behind_the_end_of_a_ray_does_not_count():
    pixels = composite(Slab(2.0, step=1 / 512), *rays(3), far=mi.Float(1.0, 1.75, 9.0))
    np.testing.assert_allclose(np.array(pixels.transmittance), np.exp([0, -0.5, -2.0]), atol=3e-3)


def test_opaque_rays_end_early():
    clear, dense = Slab(0.01, step=1 / 256), Slab(1000.0, step=1 / 256)
    for slab in (clear, dense):
        composite(slab, *rays(4))
    assert dense.evaluated < 0.5 * clear.evaluated


def test_a_coarse_march_agrees_with_a_fine_one():
    """A smooth field, the step as a preset has it against a sixteenth of that."""

    class Ball:
        mask = upload(mi.TensorXu8, np.ones((8, 8, 8), np.uint8))

        def __init__(self, step):
            self.step = step

        def evaluate(self, points, view):
            near = dr.exp(-8 * dr.squared_norm(points))
            return dr.arange(mi.UInt32, dr.width(points)), 12 * near, mi.Color3f(near, points.y + 0.5, 0.3)

    coarse, fine = (composite(Ball(step), *rays(32, 0.15)) for step in (1 / 148, 1 / 2368))
    for name in ("transmittance", "colour"):
        difference = np.abs(np.array(getattr(coarse, name)) - np.array(getattr(fine, name)))
        assert difference.max() < 1e-3


def test_samples_are_where_cells_are_occupied():
    grid = np.zeros((4, 4, 4), np.uint8)
    grid[1, 2, 2] = grid[3, 2, 2] = 1
    origin, direction, jitter = rays(1)
    origin = mi.Point3f(-2.0, 0.1, 0.1)
    pixels = march(origin, direction, mi.TensorXu8(grid), 0.01, jitter)
    x = np.array(pixels.t) - 2
    assert ((np.abs(x + 0.25) <= 0.25) | (np.abs(x - 0.75) <= 0.25)).all()
    assert abs(len(pixels) - 100) <= 2
    np.testing.assert_allclose(np.diff(np.sort(x))[:40], 0.01, atol=1e-5)


def test_rays_that_miss_the_cube_have_no_samples():
    _, direction, jitter = rays(2)
    origin = mi.Point3f(np.array([[-2, 3], [5, 0], [0, 0]], np.float32))
    mask = upload(mi.TensorXu8, np.ones((4, 4, 4), np.uint8))
    assert len(march(origin, direction, mask, 0.1, jitter)) == 0
    pixels = composite(Slab(1.0, 0.1), origin, direction, jitter)
    np.testing.assert_array_equal(np.array(pixels.transmittance), 1)


def test_weights_and_their_derivative_agree_with_loops():
    rng = np.random.default_rng(0)
    ray = np.sort(rng.integers(0, 6, 40)).astype(np.uint32)
    density = rng.uniform(0, 30, 40)
    samples = Samples(mi.UInt32(ray), upload(mi.Float, np.arange(40)), 0.05, 6)
    share, end = rng.normal(size=40), rng.normal(size=6)

    def by_loops(density):
        weights, transmittance = np.zeros(40), np.ones(6)
        for k in range(40):
            alpha = 1 - math.exp(-0.05 * density[k])
            weights[k] = transmittance[ray[k]] * alpha
            transmittance[ray[k]] *= 1 - alpha
        return weights, transmittance

    attached = mi.Float(density)
    dr.enable_grad(attached)
    weights, transmittance = weights_of(attached, samples)
    for pixels, expected in zip((weights, transmittance), by_loops(density), strict=True):
        np.testing.assert_allclose(np.array(pixels), expected, atol=1e-6)
    dr.backward(dr.sum(weights * mi.Float(share)) + dr.sum(transmittance * mi.Float(end)))

    def total(density):
        weights, transmittance = by_loops(density)
        return weights @ share + transmittance @ end

    numeric = [(total(density + e) - total(density - e)) / 2e-5 for e in 1e-5 * np.eye(40)]
    np.testing.assert_allclose(np.array(dr.grad(attached)), numeric, atol=2e-6)


def test_weights_of_a_long_batch_keep_their_digits():
    """Sums over a hundred thousand dense samples must not drown the last ray."""
    count = 100_000
    ray = np.arange(count, dtype=np.uint32) // 10
    samples = Samples(mi.UInt32(ray), upload(mi.Float, np.zeros(count)), 0.01, count // 10)
    density = np.full(count, 1000.0)
    density[-10:] = 1.0
    weights, transmittance = weights_of(mi.Float(density), samples)
    np.testing.assert_allclose(np.array(transmittance)[-1], math.exp(-0.1), rtol=1e-5)
    np.testing.assert_allclose(np.array(sum_rays(weights, samples)) + np.array(transmittance), 1, atol=1e-5)


def test_what_is_behind_an_opaque_surface_is_not_visible():
    """Rays that end in their first samples, far behind these, or never; against loops."""
    origin, direction, jitter = rays(3)
    full = upload(mi.TensorXu8, np.ones((8, 8, 8), np.uint8))
    samples = march(origin, direction, full, 1 / 128, jitter)
    looked_at = []

    def dense(points):
        looked_at.append(dr.width(points))
        starts = dr.select(points.y < -0.1, -0.9, dr.select(points.y < 0.1, 0.4, 9.0))
        return mi.Float(dr.select(points.x > starts, 240.0, 0.5))

    visible_samples = visible(samples, origin, direction, dense)
    ray, t = np.array(samples.ray), np.array(samples.t)
    density = np.array(dense(samples.points(origin, direction)))
    transmittance, expected = np.ones(3), []
    for k in range(len(ray)):
        if transmittance[ray[k]] > OPAQUE:
            expected.append((ray[k], t[k]))
        transmittance[ray[k]] *= math.exp(-density[k] / 128)
    pixels = np.stack([np.array(visible_samples.ray), np.array(visible_samples.t)], axis=1)
    np.testing.assert_array_equal(pixels, np.array(expected, np.float32))
    assert len(pixels) < 0.7 * len(ray)
    assert sum(looked_at[:-1]) < 0.75 * len(ray)  # the first ray's end is not looked at
    assert sum(looked_at[:-1]) <= np.maximum(FRONT, 2 * np.bincount(pixels[:, 0].astype(int))).sum()


def test_rays_gather_the_same_of_what_is_visible():
    origin, direction, jitter = rays(4)
    full = upload(mi.TensorXu8, np.ones((8, 8, 8), np.uint8))
    samples = march(origin, direction, full, 1 / 64, jitter)

    def dense(points):
        return 80 * dr.maximum(points.x + points.y, 0)

    def gathered(samples):
        weights, transmittance = weights_of(dense(samples.points(origin, direction)), samples)
        return np.array(sum_rays(weights * samples.t, samples)), np.array(transmittance)

    visible_samples = visible(samples, origin, direction, dense)
    assert len(visible_samples) < 0.9 * len(samples)
    for pixels, expected in zip(gathered(visible_samples), gathered(samples), strict=True):
        np.testing.assert_allclose(pixels, expected, atol=3 * OPAQUE)


def test_a_traversal_is_differentiable():
    slab = Slab(1.5, step=1 / 256)
    dr.enable_grad(slab.density)
    pixels = composite(slab, *rays(1))
    dr.backward(dr.sum(pixels.transmittance))
    np.testing.assert_allclose(np.array(dr.grad(slab.density)), -math.exp(-1.5), rtol=1e-2)
