"""Light, cameras and rendering for `make_captures.py`, and the files of a capture."""

from __future__ import annotations

import json
import math
from pathlib import Path
from typing import Any

import numpy as np
from capture_kit import Part, ball
from PIL import Image

from mitex.colour import linear_to_srgb
from mitex.geometry.tangents import split_at_hard_edges
from mitex.geometry.vectors import unit
from mitex.mesh import Mesh
from mitex.paths import atomic_write
from mitex.runtime import init
from mitex.scenes import mesh_shape

FOV = math.radians(36.0)
MARGIN = 1.01  # around the object in the narrowest view
JITTER = 0.06  # of the distance
PASS = 16  # samples per pixel rendered at once
DEPTH = 4  # of paths

# Light from all directions, and broad lobes radiance exp(sharpness (cos - 1)); z is up, everything is white.
AMBIENT = 0.45
LOBES = (
    ((0.5, 0.6, 0.9), 9.0, 5.2),
    ((-0.9, 0.2, 0.5), 5.0, 1.8),
    ((0.3, -1.0, 0.2), 12.0, 2.4),
    ((-0.1, 0.2, -1.0), 3.0, 0.5),
)


def environment(height: int = 64) -> np.ndarray:
    """The light as an image in the layout of Mitsuba's `envmap`, (height, 2 height, 3) float32 radiance."""
    v, u = np.mgrid[:height, : 2 * height] + 0.5
    polar, turn = math.pi * v / height, math.pi * u / height
    direction = np.stack(
        [np.sin(polar) * np.sin(turn), np.cos(polar), -np.sin(polar) * np.cos(turn)], axis=-1
    )
    light = np.full(direction.shape[:2], AMBIENT)
    for towards, sharpness, radiance in LOBES:
        light += radiance * np.exp(sharpness * (direction @ unit(np.array(towards)) - 1.0))
    return np.repeat(light[..., None], 3, axis=2).astype(np.float32)


def poses(rng: np.random.Generator, count: int, radius: float) -> np.ndarray:
    """(count, 4, 4) camera -> world, all around an object of `radius`; x right, y up, looks along -z."""
    back = ball(count, rng)
    distance = MARGIN * radius / math.sin(0.5 * FOV) * (1.0 + JITTER * rng.random(count))
    up = np.where(np.abs(back[:, 2:]) < 0.98, (0.0, 0.0, 1.0), (0.0, 1.0, 0.0))
    right = unit(np.cross(up, back))
    matrix = np.broadcast_to(np.eye(4), (count, 4, 4)).copy()
    matrix[:, :3] = np.stack([right, np.cross(back, right), back, distance[:, None] * back], axis=2)
    return matrix


class Studio:
    """An object in its light, photographed from any pose.

    Args:
        part: the object.
        resolution: image height and width [pixels].
    """

    def __init__(self, part: Part, resolution: int):
        self.mi = init()
        self.resolution = resolution
        self.scene = self.mi.load_dict(
            {
                "type": "scene",
                "object": object_shape(self.mi, part),
                "light": {"type": "envmap", "bitmap": self.mi.Bitmap(environment())},
                "integrator": {"type": "path", "max_depth": DEPTH, "hide_emitters": True},
                "sensor": _sensor(resolution),
            }
        )
        self.params = self.mi.traverse(self.scene)

    def photo(self, pose: np.ndarray, spp: int, seed: int) -> np.ndarray:
        """(H, W, 4) uint8 sRGB with straight alpha."""
        self._move(pose)
        total = np.zeros((self.resolution, self.resolution, 4))
        passes = -(-spp // PASS)
        for k in range(passes):
            picture = self.mi.render(self.scene, spp=min(spp, PASS), seed=seed * passes + k)
            total += np.array(picture, np.float64) / passes
        alpha = np.clip(total[..., 3:], 0.0, 1.0)
        colour = linear_to_srgb(np.clip(total[..., :3] / np.maximum(alpha, 1e-6), 0.0, 1.0))
        return np.round(255.0 * np.concatenate([np.where(alpha > 0.0, colour, 0.0), alpha], 2)).astype(
            np.uint8
        )

    def truth(self, pose: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """What the rays through the pixel centres hit.

        Returns:
            (H, W) float32 distance along the unit ray, infinite where it misses, and (H, W, 3) float32 unit
            normal of the triangle that was hit, towards the camera, zero where it misses.
        """
        mi, side = self.mi, self.resolution
        directions = pixel_rays(pose, side)
        flat = directions.reshape(-1, 3)
        # Arrays, not constants, so that one kernel serves all views.
        origins = np.broadcast_to(pose[:3, 3].astype(np.float32), flat.shape)
        ray = mi.Ray3f(mi.Point3f(origins.T.copy()), mi.Vector3f(flat.T.copy()))
        hit = self.scene.ray_intersect(ray)
        depth = np.where(hit.is_valid().numpy(), hit.t.numpy(), np.inf).astype(np.float32)
        normal = np.array(hit.n).T.astype(np.float32)
        normal *= -np.sign((normal * flat).sum(1, keepdims=True))
        normal[~np.isfinite(depth)] = 0.0
        return depth.reshape(side, side), normal.reshape(side, side, 3)

    def _move(self, pose: np.ndarray) -> None:
        # Mitsuba's cameras look along +z, their x points left.
        self.params["sensor.to_world"] = self.mi.Transform4f(pose @ np.diag([-1.0, 1.0, -1.0, 1.0]))
        self.params.update()


def pixel_rays(pose: np.ndarray, resolution: int) -> np.ndarray:
    """(H, W, 3) float32 unit directions through the pixel centres of a camera."""
    x, y = np.meshgrid(*[(np.arange(resolution) + 0.5) / focal(resolution) - math.tan(0.5 * FOV)] * 2)
    return unit(np.stack([x, -y, -np.ones_like(x)], axis=-1) @ pose[:3, :3].T).astype(np.float32)


def focal(resolution: int) -> float:
    """Focal length [pixels]."""
    return resolution / (2.0 * math.tan(0.5 * FOV))


def write_capture(
    folder: Path, part: Part, base: Mesh, *, views: int, resolution: int, spp: int, seed: int
) -> None:
    """Renders all views and writes a capture; raises OutputError where nothing can be written."""
    studio = Studio(part, resolution)
    radius = float(np.linalg.norm(part.mesh.vertices, axis=1).max())
    frames = []
    for k, pose in enumerate(poses(np.random.default_rng(seed), views, radius)):
        name = f"{k:03}"
        with atomic_write(folder / "images" / f"{name}.png") as temporary:
            Image.fromarray(studio.photo(pose, spp, seed=seed + k)).save(temporary)
        depth, normal = studio.truth(pose)
        with atomic_write(folder / "truth" / f"{name}.npz") as temporary:
            np.savez_compressed(temporary, depth=depth, normal=normal.astype(np.float16))
        frames.append({"file_path": f"images/{name}.png", "transform_matrix": pose.tolist()})
    _write_base(folder / "base.obj", base)
    with atomic_write(folder / "transforms.json") as temporary:
        temporary.write_text(json.dumps(_description(resolution) | {"frames": frames}, indent=1) + "\n")


def _description(resolution: int) -> dict[str, Any]:
    lobes = [{"towards": unit(np.array(d)).tolist(), "sharpness": k, "radiance": r} for d, k, r in LOBES]
    return {
        "camera_angle_x": FOV,
        "fl_x": focal(resolution),
        "fl_y": focal(resolution),
        "cx": 0.5 * resolution,
        "cy": 0.5 * resolution,
        "w": resolution,
        "h": resolution,
        "light": {"ambient": AMBIENT, "lobes": lobes},
    }


def _write_base(path: Path, mesh: Mesh) -> None:
    with atomic_write(path) as temporary, temporary.open("wb") as file:
        np.savetxt(file, mesh.vertices, "v %.7g %.7g %.7g")
        np.savetxt(file, mesh.faces + 1, "f %d %d %d")


def object_shape(mi: Any, part: Part) -> Any:
    """Mitsuba's shape of a part, shaded smoothly, with its colours."""
    mesh = part.mesh
    bsdf = {  # in a `twosided` it would take six times as long
        "type": "principled",
        "base_color": {"type": "mesh_attribute", "name": "vertex_color"},
        "roughness": {"type": "mesh_attribute", "name": "vertex_roughness"},
        "specular": 0.5,
    }
    shape = mesh_shape(mesh, bsdf, smooth=True, split=split_at_hard_edges(mesh))
    shape.add_attribute("vertex_color", 3, part.colours.astype(np.float32).ravel().tolist())
    shape.add_attribute("vertex_roughness", 1, part.roughness.astype(np.float32).ravel().tolist())
    return shape


def _sensor(resolution: int) -> dict[str, Any]:
    return {
        "type": "perspective",
        "fov": math.degrees(FOV),
        "near_clip": 0.01,
        "sampler": {"type": "multijitter"},
        "film": {
            "type": "hdrfilm",
            "width": resolution,
            "height": resolution,
            "pixel_format": "rgba",
            "component_format": "float32",
            "rfilter": {"type": "box"},
        },
    }
