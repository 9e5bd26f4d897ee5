"""Boxes on a mesh: which one a point belongs to, and what rays gather in them."""

from __future__ import annotations

import math

import numpy as np
import pytest

from mitex.methods.baselines.nerf_tex.anchors import Anchors
from mitex.methods.baselines.nerf_tex.boxes import Boxes
from mitex.methods.baselines.nerf_tex.instances import InstancedField
from mitex.methods.baselines.nerf_tex.networks import Inputs
from mitex.methods.nerf.field.rendering import render_rays
from mitex.methods.nerf.field.tensors import channels, rows
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

LOW, HIGH = np.array([-0.8, -0.8, -0.3]), np.array([0.8, 0.8, 0.5])


def random_anchors(count: int, seed: int = 0) -> Anchors:
    rng = np.random.default_rng(seed)
    frames = np.linalg.qr(rng.normal(size=(count, 3, 3)))[0]
    frames[np.linalg.det(frames) < 0, 2] *= -1
    return Anchors(rng.uniform(-0.6, 0.6, (count, 3)).astype(np.float32), frames.astype(np.float32))


def brute_force(anchors: Anchors, half: float, points: np.ndarray, lift: float):
    """Nearest box, number of boxes, and place in the nearest, one box after another."""
    nearest, least = np.full(len(points), -1), np.full(len(points), np.inf)
    overlaps, place = np.zeros(len(points), int), np.zeros((len(points), 3))
    for k, (anchor, frame) in enumerate(zip(anchors.points, anchors.frames, strict=True)):
        local = (points - anchor - lift * frame[2]) @ frame.T / half
        inside = ((local >= LOW) & (local <= HIGH)).all(1)
        overlaps += inside
        distance = np.linalg.norm(local, axis=1)
        closer = inside & (distance < least)
        nearest[closer], least[closer], place[closer] = k, distance[closer], local[closer]
    return nearest, overlaps, place


@pytest.mark.parametrize("lift", [0.0, 0.08])
def test_points_find_their_boxes(lift):
    anchors = random_anchors(60)
    points = np.random.default_rng(1).uniform(-1, 1, (20_000, 3)).astype(np.float32)
    box, overlaps, local = Boxes(anchors, 0.25, LOW, HIGH, lift).nearest(channels(mi.Point3f, points))
    nearest, count, place = brute_force(anchors, 0.25, points, lift)
    border = np.abs(np.concatenate([place - LOW, place - HIGH], 1)).min(1) < 1e-4
    same = np.array(overlaps) == count
    assert (same | border).all() or (~same).sum() <= 4  # of points on a border, floats decide
    inside = same & (count > 0)
    assert count.max() >= 3 and inside.sum() > 2000
    assert (np.array(box)[inside] == nearest[inside]).mean() > 0.999
    agree = inside & (np.array(box) == nearest)
    assert np.abs(rows(local)[agree] - place[agree]).max() < 1e-4


def ball_in_a_box(inputs: Inputs):
    """A ball of density 9 around (0.2, 0, 0.1), in the colours of place, view and light."""
    inside = dr.squared_norm(inputs.points - mi.Point3f(0.2, 0, 0.1)) < 0.25**2
    mixed = mi.Vector3f(inputs.points) * 0.25 + inputs.view * 0.15 + inputs.light * 0.1
    return dr.select(inside, mi.Float(9), 0), mi.Color3f(0.5 + mixed)


def instanced(anchors: Anchors, half: float = 0.3, light=(0.0, 0.6, 0.8)) -> InstancedField:
    boxes = Boxes(anchors, half, LOW, HIGH)
    return InstancedField(boxes, ball_in_a_box, np.ones((8,) * 3, np.uint8), 0.01, np.array(light))


def test_rays_gather_what_a_march_through_all_boxes_does():
    """Against a slow one in NumPy: nearest box of those that a sample is in, density by their number."""
    anchors, half, step, light = random_anchors(12, seed=3), 0.3, 0.01, np.array([0.0, 0.6, 0.8])
    field = instanced(anchors)
    field.mask = upload(mi.TensorXu8, np.ones((16,) * 3, np.uint8))
    rng = np.random.default_rng(5)
    origins = rng.normal(size=(40, 3))
    origins *= 2.5 / np.linalg.norm(origins, axis=1, keepdims=True)
    directions = rng.uniform(-0.5, 0.5, (40, 3)) - origins
    directions /= np.linalg.norm(directions, axis=1, keepdims=True)
    colour, transmittance = render_rays(field, origins.astype(np.float32), directions.astype(np.float32))
    assert (transmittance < 0.5).sum() > 6 and (transmittance == 1).sum() > 2
    for k in range(40):
        expected, passing = march_slowly(anchors, half, step, light, origins[k], directions[k])
        assert transmittance[k] == pytest.approx(passing, abs=0.03)
        assert colour[k] == pytest.approx(expected, abs=0.03)


def march_slowly(anchors, half, step, light, origin, direction):
    with np.errstate(divide="ignore"):
        ends = np.stack([(-1 - origin) / direction, (1 - origin) / direction])
    enter, leave = ends.min(0).max(), ends.max(0).min()
    points = origin + direction * (enter + np.arange(0.5 * step, leave - enter, step)[:, None])
    nearest, overlaps, place = brute_force(anchors, half, points, 0.0)
    total, passing = np.zeros(3), 1.0
    for box, count, local in zip(nearest, overlaps, place, strict=True):
        if count and np.sum((local - [0.2, 0, 0.1]) ** 2) < 0.25**2:
            frame = anchors.frames[box]
            shown = 0.5 + 0.25 * local + 0.15 * frame @ direction + 0.1 * frame @ light
            opacity = 1 - math.exp(-9 / half / count * step)
            total += passing * opacity * shown
            passing *= 1 - opacity
    return total, passing


def test_overlaps_divide_the_density():
    """Of k boxes in one place each point has the density of one by k, and that belongs to one of them."""
    one = random_anchors(1)
    points = (one.points + 0.3 * np.array([[0.2, 0, 0.1]]) @ one.frames[0]).astype(np.float32)
    densities = []
    for count in (1, 2, 5):
        same = Anchors(one.points.repeat(count, 0), one.frames.repeat(count, 0))
        densities.append(float(instanced(same).density_at(points)[0]))
    assert densities == pytest.approx([9 / 0.3, 9 / 0.6, 9 / 1.5])


def test_empty_cells_of_a_box_are_empty():
    one = random_anchors(1)
    points = (one.points + 0.3 * np.array([[0.2, 0, 0.1]]) @ one.frames[0]).astype(np.float32)
    occupied = np.zeros((8,) * 3, np.uint8)
    empty = InstancedField(Boxes(one, 0.3, LOW, HIGH), ball_in_a_box, occupied, 0.01, np.array([0, 0, 1]))
    assert empty.density_at(points) == 0 and not np.array(empty.mask).any()
