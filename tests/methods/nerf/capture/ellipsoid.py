"""Captures of an ellipsoid whose every ray is known."""

import json
import math

import numpy as np
from PIL import Image

RADII = np.array([1.0, 0.7, 0.5])
CENTRE = np.array([5.0, -3.0, 2.0])
SIZE = 48
FOCAL = 60.0


def look_at(direction, distance=4.0, target=CENTRE):
    """Camera -> world, (4, 4): at `distance` in the given direction from the target, looking at it."""
    back = np.asarray(direction, float) / np.linalg.norm(direction)
    right = np.cross([0.1, 0.2, 1.0], back)
    right /= np.linalg.norm(right)
    pose = np.eye(4)
    pose[:3] = np.stack([right, np.cross(back, right), back, target + distance * back], axis=1)
    return pose


def directions(count):
    k = np.arange(count) + 0.5
    z, angle = 1 - 2 * k / count, math.pi * (3 - math.sqrt(5)) * k
    return np.stack([np.sqrt(1 - z * z) * np.cos(angle), np.sqrt(1 - z * z) * np.sin(angle), z], axis=1)


def ellipsoid_mask(pose, width=SIZE, height=SIZE, focal=FOCAL):
    """(H, W) bool: which pixel centres show the ellipsoid."""
    x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
    rays = np.stack([x / focal, -y / focal, -np.ones_like(x)], axis=-1) @ pose[:3, :3].T / RADII
    start = (pose[:3, 3] - CENTRE) / RADII
    a, b, c = (rays**2).sum(-1), rays @ start, start @ start - 1
    return (b * b - a * c >= 0) & (b < 0)


def rgba(mask, colour=(200, 120, 40)):
    return np.concatenate(
        [np.broadcast_to(np.uint8(colour), (*mask.shape, 3)), np.uint8(255) * mask[..., None]], 2
    )


def write(folder, count=12, change=None, frames=None):
    """A capture with alpha; `change(tree)` edits the JSON before it is written."""
    (folder / "images").mkdir(parents=True, exist_ok=True)
    tree = {"fl_x": FOCAL, "fl_y": FOCAL, "w": SIZE, "h": SIZE, "cx": SIZE / 2, "cy": SIZE / 2, "frames": []}
    for k, direction in enumerate(directions(count)):
        pose = look_at(direction)
        Image.fromarray(rgba(ellipsoid_mask(pose))).save(folder / "images" / f"{k:03}.png")
        tree["frames"].append({"file_path": f"images/{k:03}.png", "transform_matrix": pose.tolist()})
    if change:
        change(tree)
    (folder / "transforms.json").write_text(json.dumps(tree))
    return folder


def surface(count=200):
    """Points of the ellipsoid in the capture's world."""
    return CENTRE + RADII * directions(count)


def set_alpha(folder, views, alpha):
    for view in views:
        path = folder / "images" / f"{view:03}.png"
        image = Image.open(path)
        image.putalpha(alpha)
        image.save(path)
