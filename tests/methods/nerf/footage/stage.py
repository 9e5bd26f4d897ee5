"""A spotted ellipsoid on a patterned table in a plain room, seen from known places, pixel by pixel."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np
import pytest

from mitex.geometry.vectors import unit
from mitex.methods.nerf.capture.colmap import Structure
from mitex.methods.nerf.capture.visual_hull import project

WIDTH, HEIGHT, FOCAL = 160, 120, 170.0
INTRINSICS = np.array([FOCAL, FOCAL, WIDTH / 2, HEIGHT / 2])
RADII = np.array([0.5, 0.4, 0.45])
TABLE = 1.6  # radius of the round table top, which is at z = 0
WALL = (40, 150, 60)
VIEWS = 10


def pose_at(azimuth: float, elevation: float, distance: float = 2.8) -> np.ndarray:
    """(3, 4) camera -> world, towards the ellipsoid's middle."""
    level = math.cos(elevation)
    back = np.array([math.cos(azimuth) * level, math.sin(azimuth) * level, math.sin(elevation)])
    right = unit(np.cross((0.0, 0.0, 1.0), back))
    place = (0.0, 0.0, RADII[2]) + distance * back
    return np.stack([right, np.cross(back, right), back, place], axis=1)


POSES = [pose_at(2 * math.pi * k / VIEWS, 0.3 + 0.12 * (k % 2)) for k in range(VIEWS)]


def shot(pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(H, W, 3) uint8 picture and (H, W) bool mask of the ellipsoid."""
    x, y = np.meshgrid(np.arange(WIDTH) + 0.5 - WIDTH / 2, np.arange(HEIGHT) + 0.5 - HEIGHT / 2)
    rays = np.stack([x, -y, np.full_like(x, -FOCAL)], axis=-1) @ pose[:, :3].T
    t, mask = _ellipsoid(pose[:, 3], rays)
    with np.errstate(divide="ignore", invalid="ignore"):
        down = -pose[2, 3] / rays[..., 2]
    ground = pose[:, 3] + down[..., None] * rays
    table = (down > 0) & (np.linalg.norm(ground[..., :2], axis=-1) < TABLE)
    picture = np.where(table[..., None], _pattern(ground, (110, 90, 130), 3), np.array(WALL))
    skin = _pattern(pose[:, 3] + t[..., None] * rays, (190, 120, 50), 7)
    return np.where(mask[..., None], skin, picture).astype(np.uint8), mask


def structure(names: Sequence[str], rng: np.random.Generator) -> Structure:
    """What structure from motion would find in all views, photos called `names`.

    Returns:
        300 points of the ellipsoid and 400 of the table, and the cameras, in a turned world.
    """
    directions = unit(rng.normal(size=(300, 3)))
    skin = directions * RADII + (0.0, 0.0, RADII[2])
    radius, turn = TABLE * np.sqrt(rng.random(400)), rng.uniform(0.0, 2.0 * math.pi, 400)
    table = np.stack([radius * np.cos(turn), radius * np.sin(turn), 0.0 * turn], axis=1)
    points, normals = (
        np.concatenate([skin, table]),
        np.concatenate([directions / RADII, 0.0 * table + (0, 0, 1)]),
    )
    sightings = [(k, index) for k, pose in enumerate(POSES) for index in _visible(points, normals, pose)]
    world = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
    world *= np.sign(np.linalg.det(world))
    lens = {"w": WIDTH, "h": HEIGHT, "fl_x": FOCAL, "fl_y": FOCAL, "cx": WIDTH / 2, "cy": HEIGHT / 2}
    frames = [
        {"file_path": name, **lens, "transform_matrix": (world @ pose).tolist()}
        for name, pose in zip(names, POSES, strict=True)
    ]
    noisy = points + 0.002 * rng.normal(size=points.shape)
    return Structure({"frames": frames}, noisy @ world.T, np.array(sightings, np.int64))


def coarse_volumes(patch: pytest.MonkeyPatch) -> None:
    """Volumes of an eighth of the voxels, which small pictures can do with."""
    for module in ("capture.visual_hull", "footage.guess"):
        patch.setattr(f"mitex.methods.nerf.{module}.RESOLUTION", 32)


def overlap(first: np.ndarray, second: np.ndarray) -> float:
    """Intersection over union of two masks."""
    return float((first & second).sum() / max((first | second).sum(), 1))


def _ellipsoid(origin: np.ndarray, rays: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    start, slope = (origin - (0.0, 0.0, RADII[2])) / RADII, rays / RADII
    a, b, c = (slope**2).sum(-1), slope @ start, start @ start - 1
    root = b * b - a * c
    return (-b - np.sqrt(np.maximum(root, 0.0))) / a, root > 0


def _pattern(points: np.ndarray, colour: tuple[int, int, int], seed: int) -> np.ndarray:
    rng = np.random.default_rng(seed)
    waves = rng.normal(size=(3, 30)) * 12.0
    field = np.cos(points @ waves) @ rng.normal(size=30)
    return np.clip(np.array(colour) + 8.0 * field[..., None], 0, 255)


def _visible(points: np.ndarray, normals: np.ndarray, pose: np.ndarray) -> np.ndarray:
    towards = pose[:, 3] - points
    pixels, depth = project(points, pose, INTRINSICS, np.zeros(4))
    hit, behind = _ellipsoid(pose[:, 3], -towards)
    inside = (depth > 0) & (pixels > 0).all(1) & (pixels < (WIDTH, HEIGHT)).all(1)
    return np.flatnonzero(inside & ((normals * towards).sum(1) > 0) & ~(behind & (hit < 0.99)))
