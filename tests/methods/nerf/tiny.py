"""A small capture in memory: a coloured bumpy ball, rendered by Mitsuba."""

from __future__ import annotations

import json
import math
from functools import cache
from pathlib import Path

import numpy as np
from PIL import Image

from mitex.mesh import Mesh, Similarity, icosphere
from mitex.methods.nerf.capture.capture import Capture
from mitex.runtime import init
from mitex.scenes.shapes import mesh_shape

FOV = 40.0
DISTANCE = 2.2
SETTINGS = (  # of a small real fit
    "steps=160",
    "lr_steps=160",
    "base_steps=150",
    "rays=1024",
    "ray_steps=192",
    "table=13",
    "coarsest=32",
    "finest=128",
    "occupancy=48",
    "average=0.5",
    "preview_every=160",
    "checkpoint_every=80",
)


def bumpy(amplitude: float = 0.08, frequency: int = 24) -> Mesh:
    """A ball of radius 0.55 with bumps of size `amplitude`."""
    ball = icosphere(frequency)
    x, y, z = ball.vertices.T
    bump = np.cos(9 * x) * np.cos(9 * y) * np.cos(9 * z)
    return Mesh(ball.vertices * (0.55 + amplitude * bump)[:, None], ball.faces, name="bumpy")


@cache
def tiny_capture(views: int = 16, side: int = 48, spp: int = 16, seed: int = 0) -> Capture:
    """`views` pictures of the ball from all around, side x side."""
    return captured(bumpy(), views, side, spp, seed)


def write_capture(capture: Capture, folder: Path) -> None:
    """Writes a capture in the layout of NeRF-synthetic; its world is the scene cube."""
    folder.mkdir(parents=True)
    frames = []
    for name, image, pose in zip(capture.names, capture.images, capture.poses, strict=True):
        Image.fromarray(image).save(folder / name)
        frames.append({"file_path": name, "transform_matrix": [*pose.tolist(), [0, 0, 0, 1]]})
    fx, fy, cx, cy = capture.intrinsics[0].tolist()
    camera = {"fl_x": fx, "fl_y": fy, "cx": cx, "cy": cy}
    (folder / "transforms.json").write_text(json.dumps({**camera, "frames": frames}))


def captured(mesh: Mesh, views: int, side: int, spp: int, seed: int = 0) -> Capture:
    """Pictures of a mesh with waves of colour, on which cameras all around look."""
    mi = init()
    rng = np.random.default_rng(seed)
    colours = 0.5 + 0.5 * np.sin(7 * mesh.vertices + np.array([0.0, 2.0, 4.0]))
    shape = mesh_shape(
        mesh,
        mi.load_dict({"type": "diffuse", "reflectance": {"type": "mesh_attribute", "name": "vertex_color"}}),
    )
    shape.add_attribute("vertex_color", 3, colours.astype(np.float32).ravel().tolist())
    images, poses = [], []
    for k in range(views):
        pose = _pose(k, views, rng)
        images.append(_picture(mi, shape, pose, side, spp, k))
        poses.append(pose)
    focal = 0.5 * side / math.tan(math.radians(FOV) / 2)
    intrinsics = np.tile([focal, focal, side / 2, side / 2], (views, 1)).astype(np.float32)
    return Capture(
        tuple(images),
        np.array(poses, np.float32),
        intrinsics,
        np.zeros((views, 4), np.float32),
        tuple(f"{k}.png" for k in range(views)),
        Similarity(np.zeros(3), 1.0),
        "tiny",
    )


def _pose(k: int, views: int, rng: np.random.Generator) -> np.ndarray:
    y = 1 - (2 * k + 1) / views
    angle = math.pi * (3 - math.sqrt(5)) * k + rng.uniform(0, 0.1)
    back = np.array([math.sqrt(1 - y * y) * math.sin(angle), y, math.sqrt(1 - y * y) * math.cos(angle)])
    right = np.cross([0.0, 1.0, 0.0], back)
    right /= np.linalg.norm(right)
    return np.column_stack([right, np.cross(back, right), back, DISTANCE * back])


def _picture(mi, shape, pose: np.ndarray, side: int, spp: int, seed: int) -> np.ndarray:
    eye, back, up = pose[:, 3], pose[:, 2], pose[:, 1]
    scene = mi.load_dict(
        {
            "type": "scene",
            "integrator": {"type": "path", "max_depth": 3, "hide_emitters": True},
            "light": {"type": "constant", "radiance": 0.9},
            "shape": shape,
            "sensor": {
                "type": "perspective",
                "fov": FOV,
                "to_world": mi.ScalarTransform4f().look_at(eye.tolist(), (eye - back).tolist(), up.tolist()),
                "film": {
                    "type": "hdrfilm",
                    "width": side,
                    "height": side,
                    "pixel_format": "rgba",
                    "rfilter": {"type": "box"},
                },
            },
        }
    )
    rgba = np.array(mi.render(scene, spp=spp, seed=seed))
    alpha = np.clip(rgba[..., 3:], 0, 1)
    colour = np.clip(rgba[..., :3] / np.maximum(alpha, 1e-3), 0, 1) ** (1 / 2.2)
    return np.round(255 * np.concatenate([colour, alpha], 2)).astype(np.uint8)
