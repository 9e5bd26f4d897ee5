"""Films an object on a table as a phone would: a video that `mitex capture` can fail on, with the truth.

    python tools/film_capture.py [--out DIR] [--frames N] [--width PX] [--spp N] [--seed N] [NAME]

DIR/NAME.mp4 is a walk around the object in three rings with an unsteady hand: motion blur, exposure that
drifts and jumps, noise of the sensor, compression, a table and walls with textures. DIR/NAME-truth.npz has
the cameras at the middle of each exposure and the focal length, DIR/NAME-masks/ where the object is.
"""

from __future__ import annotations

import argparse
import math
import subprocess
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import numpy as np
from capture_kit import Part
from capture_studio import environment, object_shape
from imageio_ffmpeg import get_ffmpeg_exe
from make_captures import KINDS, SEEDS
from PIL import Image

from mitex.colour import linear_to_srgb
from mitex.geometry.vectors import unit
from mitex.paths import atomic_write, prepare_folder
from mitex.runtime import init

OUT = Path(__file__).parents[1] / "out" / "films"
EXEMPLARS = Path(__file__).parents[1] / "mitex" / "data" / "exemplars"
RINGS = (12.0, 36.0, 62.0)  # elevations of the camera [degrees]
SECONDS = 40.0  # of the walk
FOV = math.radians(48.0)  # across
ASPECT = 3 / 4  # height to width
SHUTTER = 1 / 60  # time in which light falls in [s]
EXPOSURES = 3  # poses that one frame is averaged from
DISTANCE = 3.6  # of the camera [radii of the object]
NOISE = (0.004, 0.012)  # of the sensor: constant, and by the root of the light
QUALITY = 23  # constant rate factor of H.264
ROOM = (6.0, 4.5)  # half the width, and the height of the room [radii of the object]


def shake(rng: np.random.Generator, times: np.ndarray) -> np.ndarray:
    """(T, 6) unit tremor of a hand at times [s]: slow sway, and a jerk now and then."""
    waves = np.zeros((len(times), 6))
    for hertz, strength in ((0.3, 0.7), (0.9, 0.4), (2.6, 0.15), (6.0, 0.05)):
        phase = rng.uniform(0.0, 2.0 * math.pi, 6)
        waves += strength * np.sin(2.0 * math.pi * hertz * times[:, None] * rng.uniform(0.8, 1.2, 6) + phase)
    for start in rng.uniform(times[0], times[-1], 8):
        waves += rng.normal(size=6) * np.exp(-(((times - start) / 0.12) ** 2))[:, None]
    return waves


def walk(rng: np.random.Generator, times: np.ndarray, radius: float) -> np.ndarray:
    """(T, 4, 4) camera -> world; x right, y up, looks along -z: three rings around the origin."""
    share = np.clip(times / times[-1], 0.0, 1.0) * len(RINGS)
    elevation = np.radians(np.interp(share, np.arange(len(RINGS)) + 0.5, RINGS))
    azimuth = 2.0 * math.pi * share
    tremor = shake(rng, times)
    back = np.stack(
        [np.cos(azimuth) * np.cos(elevation), np.sin(azimuth) * np.cos(elevation), np.sin(elevation)], axis=1
    )
    place = radius * (DISTANCE * back + 0.05 * tremor[:, :3])
    back = unit(place + 0.1 * radius * tremor[:, 3:])
    right = unit(np.cross(np.array((0.0, 0.0, 1.0)), back))
    roll = np.radians(2.0 * tremor[:, 5])[:, None]
    up = np.cross(back, right)
    right, up = np.cos(roll) * right + np.sin(roll) * up, np.cos(roll) * up - np.sin(roll) * right
    matrix = np.broadcast_to(np.eye(4), (len(times), 4, 4)).copy()
    matrix[:, :3] = np.stack([right, up, back, place], axis=2)
    return matrix


def exposure(rng: np.random.Generator, times: np.ndarray) -> np.ndarray:
    """(T,) gain of an automatic exposure: it drifts, and twice it jumps and settles."""
    gain = 0.18 * np.sin(2.0 * math.pi * times / 5.3) + 0.08 * np.sin(2.0 * math.pi * times / 1.7)
    for start in rng.uniform(times[0], times[-1], 2):
        gain += rng.choice([-0.9, 0.7]) * (times >= start) * np.exp(-(times - start) / 0.25)
    return np.exp(gain)


class Room:
    """An object on a table in a room, filmed from any pose.

    Args:
        part: the object.
        width: of a frame [pixels].
    """

    def __init__(self, part: Part, width: int):
        self.mi = init()
        self.size = (width, round(ASPECT * width))
        points = part.mesh.vertices
        self.radius = float(np.linalg.norm(points, axis=1).max())
        table = float(points[:, 2].min()) + 0.04 * self.radius
        self.scene = self.mi.load_dict(
            {
                "type": "scene",
                "object": object_shape(self.mi, part),
                "light": {"type": "envmap", "bitmap": self.mi.Bitmap(environment())},
                "integrator": {"type": "path", "max_depth": 2},
                "sensor": _sensor(*self.size),
                **self._surroundings(table),
            }
        )
        self.params = self.mi.traverse(self.scene)

    def _surroundings(self, table: float) -> dict[str, Any]:
        """A table top, and four walls that let the light in from above."""
        place, (half, height) = self.mi.ScalarTransform4f, np.array(ROOM) * self.radius
        top = place().translate([0, 0, table]).scale([2.2 * self.radius, 1.8 * self.radius, 1])
        shapes = {"table": self._plane("planks", top, 2.0)}
        for k, name in enumerate(("bricks", "leather", "hexagons", "rust")):
            turn = place().rotate([0, 0, 1], 90.0 * k + 20.0)
            upright = place().translate([half, 0, table]).rotate([0, 1, 0], -90.0)
            wall = turn @ upright @ place().rotate([0, 0, 1], 90.0).scale([half, height, 1])
            shapes[f"wall{k}"] = self._plane(name, wall, 3.0)
        floor = place().translate([0, 0, table - height]).scale([2 * half, 2 * half, 1])
        return shapes | {"floor": self._plane("cobblestone", floor, 8.0)}

    def _plane(self, exemplar: str, place: Any, tiles: float) -> dict[str, Any]:
        picture = {
            "type": "bitmap",
            "filename": str(EXEMPLARS / exemplar / "albedo.png"),
            "to_uv": self.mi.ScalarTransform4f().scale([tiles, tiles, 1]),
        }
        bsdf = {"type": "twosided", "bsdf": {"type": "diffuse", "reflectance": picture}}
        return {"type": "rectangle", "to_world": place, "bsdf": bsdf}

    def light(self, poses: np.ndarray, spp: int, seed: int) -> np.ndarray:
        """(H, W, 3) linear radiance, the mean over the poses (K, 4, 4)."""
        total = np.zeros((self.size[1], self.size[0], 3))
        for k, pose in enumerate(poses):
            self._move(pose)
            total += np.array(self.mi.render(self.scene, spp=spp, seed=seed * len(poses) + k))[..., :3]
        return total / len(poses)

    def mask(self, pose: np.ndarray) -> np.ndarray:
        """(H, W) bool, where the object is seen."""
        mi, (width, height) = self.mi, self.size
        scale = 2.0 * math.tan(0.5 * FOV) / width
        x, y = np.meshgrid(np.arange(width) + 0.5 - width / 2, np.arange(height) + 0.5 - height / 2)
        rays = unit(np.stack([scale * x, -scale * y, -np.ones_like(x)], axis=-1) @ pose[:3, :3].T)
        flat = rays.reshape(-1, 3).astype(np.float32)
        origins = np.broadcast_to(pose[:3, 3].astype(np.float32), flat.shape).T.copy()
        hit = self.scene.ray_intersect(mi.Ray3f(mi.Point3f(origins), mi.Vector3f(flat.T.copy())))
        near = np.array(hit.p).T
        inside = hit.is_valid().numpy() & (hit.shape == mi.ShapePtr(self.scene.shapes()[self._index])).numpy()
        return (inside & np.isfinite(near).all(axis=1)).reshape(height, width)

    @property
    def _index(self) -> int:
        return [shape.id() for shape in self.scene.shapes()].index("object")

    def _move(self, pose: np.ndarray) -> None:
        self.params["sensor.to_world"] = self.mi.Transform4f(pose @ np.diag([-1.0, 1.0, -1.0, 1.0]))
        self.params.update()


def developed(light: np.ndarray, gain: float, rng: np.random.Generator) -> np.ndarray:
    """(H, W, 3) uint8 sRGB of what a small sensor makes of linear light."""
    exposed = np.clip(gain * light, 0.0, None)
    exposed += rng.normal(size=light.shape) * np.sqrt(NOISE[0] ** 2 + NOISE[1] ** 2 * exposed)
    return np.round(255.0 * linear_to_srgb(np.clip(exposed, 0.0, 1.0))).astype(np.uint8)


def film(room: Room, path: Path, frames: int, spp: int, seed: int) -> np.ndarray:
    """Writes the video, and gives the poses at the middle of the exposures, (N, 4, 4)."""
    rng = np.random.default_rng(seed)
    times = np.linspace(0.0, SECONDS, frames)[:, None] + np.linspace(0.0, SHUTTER, EXPOSURES)
    poses = walk(rng, times.ravel(), room.radius).reshape(frames, EXPOSURES, 4, 4)
    gains = exposure(rng, times[:, 0])

    def pictures() -> Iterator[np.ndarray]:
        for k in range(frames):
            yield developed(room.light(poses[k], spp, seed + k), gains[k], rng)
            print(f"\r{path}: {k + 1} of {frames}", end="", flush=True)
        print()

    with atomic_write(path) as temporary:
        _encode(temporary, pictures(), room.size, frames / SECONDS)
    return poses[:, EXPOSURES // 2]


def _encode(path: Path, pictures: Iterator[np.ndarray], size: tuple[int, int], fps: float) -> None:
    raw = f"-f rawvideo -pix_fmt rgb24 -s {size[0]}x{size[1]} -r {fps:g} -i -"
    mp4 = f"-an -vcodec libx264 -pix_fmt yuv420p -crf {QUALITY}"
    command = [get_ffmpeg_exe(), "-y", "-loglevel", "error", *raw.split(), *mp4.split(), str(path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE) as encoder:
        assert encoder.stdin is not None
        for picture in pictures:
            encoder.stdin.write(picture.tobytes())
        encoder.stdin.close()
    if encoder.returncode:
        raise SystemExit("ffmpeg failed")


def write_truth(room: Room, stem: Path, poses: np.ndarray) -> None:
    """Cameras as .npz and masks as .png files, one of each frame."""
    width, _ = room.size
    focal = width / (2.0 * math.tan(0.5 * FOV))
    with atomic_write(stem.with_name(f"{stem.name}-truth.npz")) as temporary:
        np.savez(temporary, poses=poses, focal=focal, radius=room.radius)
    folder = prepare_folder(stem.with_name(f"{stem.name}-masks"))
    for k, pose in enumerate(poses):
        Image.fromarray(room.mask(pose)).save(folder / f"{k:05}.png")


def _sensor(width: int, height: int) -> dict[str, Any]:
    film = {"type": "hdrfilm", "width": width, "height": height, "rfilter": {"type": "box"}}
    return {
        "type": "perspective",
        "fov": math.degrees(FOV),
        "near_clip": 0.01,
        "sampler": {"type": "independent"},
        "film": film | {"pixel_format": "rgb", "component_format": "float32"},
    }


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("name", nargs="?", metavar="NAME", default="durian", choices=KINDS)
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--frames", type=int, default=130, help="of the whole walk")
    parser.add_argument("--width", type=int, default=560, help="[pixels]")
    parser.add_argument("--spp", type=int, default=2, help="samples per pixel of each of the exposures")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    _, part = KINDS[options.name](np.random.default_rng([options.seed, SEEDS[options.name]]))
    room, stem = Room(part, options.width), options.out / options.name
    poses = film(room, stem.with_suffix(".mp4"), options.frames, options.spp, options.seed)
    write_truth(room, stem, poses)


if __name__ == "__main__":
    main()
