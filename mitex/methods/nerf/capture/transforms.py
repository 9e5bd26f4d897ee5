"""Reading `transforms.json`: the cameras of a capture as frames, every number and path checked."""

from __future__ import annotations

import json
import math
import os
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeGuard, TypeVar

import numpy as np

from mitex.errors import CaptureError
from mitex.images import SUFFIXES
from mitex.reading import content, reading

ONE_FILE = "transforms.json"
SPLIT_FILES = ("transforms_train.json", "transforms_val.json", "transforms_test.json")
LARGEST = 256 << 20  # such a file [bytes]
FOCAL = (0.02, 1e4)  # focal lengths that a lens may have [image sizes]
FARTHEST = 1e9  # coordinate of a camera that float64 can work with
D = TypeVar("D", float, None)

ASPECT = 0.01  # singular values of a rotation may differ by this ratio


@dataclass(frozen=True, eq=False)
class Frame:
    """A photo and its camera, as written in the file.

    Attributes:
        name: Path of the image relative to the folder.
        image, mask: Files; `mask` is None where the image's alpha has to do.
        pose: (3, 4) float64 camera -> world of the capture, rotation orthonormal; x right, y up, looks
            along -z.
        lens: The numbers of the file that describe the lens, the frame's own before those of all frames.
    """

    name: str
    image: Path
    mask: Path | None
    pose: np.ndarray
    lens: Mapping[str, object]

    def intrinsics(self, width: int, height: int) -> tuple[np.ndarray, np.ndarray]:
        """(fx, fy, cx, cy) [pixels] and (k1, k2, p1, p2) for an image of that size, float64.

        Raises:
            CaptureError: The file tells another size, no focal length, or numbers that make no sense.
        """
        size = (self._number("w", width), self._number("h", height))
        if size != (width, height):
            raise CaptureError(
                f"{self.name} is {width} x {height}, but its camera {size[0]:g} x {size[1]:g} pixels",
                "use the images that the cameras were computed from",
            )
        fx, fy = self._focal("x", width), self._focal("y", height)
        if fx is None and fy is None:
            raise CaptureError(f"{self.name} has no focal length", "add fl_x or camera_angle_x to its file")
        fx, fy = fx or fy, fy or fx
        centre = self._number("cx", width / 2), self._number("cy", height / 2)
        if self._is_fisheye or any(self._number(k, 0.0) for k in ("k3", "k4")):
            raise CaptureError(
                f"{self.name} has a lens other than k1, k2, p1, p2", "undistort the images beforehand"
            )
        distortion = [self._number(k, 0.0) for k in ("k1", "k2", "p1", "p2")]
        return np.array([fx, fy, *centre], np.float64), np.array(distortion, np.float64)

    @property
    def _is_fisheye(self) -> bool:
        """Whether the file says so: by the flag of instant-ngp, or the camera model of Nerfstudio."""
        return bool(self.lens.get("is_fisheye")) or "FISHEYE" in str(self.lens.get("camera_model")).upper()

    def _focal(self, axis: str, size: int) -> float | None:
        if (focal := self._number(f"fl_{axis}", None)) is None:
            if (angle := self._number(f"camera_angle_{axis}", None)) is None:
                return None
            if not 0.0 < angle < math.pi:
                raise CaptureError(f"{self.name} has camera_angle_{axis} {angle:g}", "give radians below pi")
            focal = size / (2.0 * math.tan(0.5 * angle))
        if not FOCAL[0] < focal / size < FOCAL[1]:
            raise CaptureError(
                f"{self.name} is {size} pixels, its fl_{axis} {focal:g}", "give the focal length in pixels"
            )
        return focal

    def _number(self, key: str, default: D) -> float | D:
        value = self.lens.get(key, default)
        if value is default:
            return default
        if not _is_number(value):
            raise CaptureError(f"{self.name} has {key} {str(value)[:40]!r}", "give a finite number")
        return value


def transforms_files(folder: Path) -> list[Path]:
    """The files that list the cameras: `transforms.json`, or those of the splits of NeRF-synthetic."""
    if (one := folder / ONE_FILE).is_file():
        return [one]
    return [path for name in SPLIT_FILES if (path := folder / name).is_file()]


def read_frames(path: Path) -> list[Frame]:
    """The frames of a `transforms*.json`, images and masks found but not opened.

    Raises:
        CaptureError: The file is damaged, or a frame lacks its image or a proper pose.
    """
    with reading(path, CaptureError, "write it again"):
        tree = json.loads(content(path, LARGEST))
    return parse_frames(tree, path.parent, path.name)


def parse_frames(tree: Any, folder: Path, source: str) -> list[Frame]:
    """The frames of such a file's content; paths are relative to `folder`, `source` is for messages.

    Raises:
        CaptureError: as `read_frames`.
    """
    frames = tree.get("frames") if isinstance(tree, dict) else None
    if not isinstance(frames, list) or not frames:
        raise CaptureError(f"{source} has no list of frames", "give one frame for every image")
    return [_frame(folder, tree, frame, f"{source}: frame {k}") for k, frame in enumerate(frames)]


def _frame(folder: Path, tree: dict[str, Any], frame: Any, where: str) -> Frame:
    relative = frame.get("file_path") if isinstance(frame, dict) else None
    if not isinstance(relative, str) or not relative:
        raise CaptureError(f"{where} has no file_path", "name its image")
    image = _find(folder, relative, where)
    name = image.relative_to(folder.resolve()).as_posix()
    lens = {k: v for k, v in (tree | frame).items() if k not in ("frames", "transform_matrix")}
    mask = _mask(folder, image, frame.get("mask_path"), where)
    return Frame(name, image, mask, _pose(frame.get("transform_matrix"), name), lens)


def _find(folder: Path, relative: str, where: str) -> Path:
    """The file that a frame names, with or without its suffix."""
    for suffix in ("", *SUFFIXES):
        path = _inside(folder, relative + suffix, where)
        if os.path.isfile(path):  # unlike Path.is_file, also answers for impossible names
            return path
    raise CaptureError(
        f"{where} names '{relative[:80]}', which does not exist", "add the file or drop the frame"
    )


def _inside(folder: Path, relative: str, where: str) -> Path:
    try:
        path = (folder / relative).resolve()
    except (OSError, ValueError, RuntimeError) as error:
        raise CaptureError(f"{where} names {relative[:80]!r}, which is no path", "name a file") from error
    if not path.is_relative_to(folder.resolve()):
        raise CaptureError(f"{where} names '{relative}', outside of {folder}", "keep all files in the folder")
    return path


def find_mask(folder: Path, image: Path) -> Path | None:
    """The mask of an image in `masks/`, if there is one."""
    for name in (f"{image.stem}.png", f"{image.name}.png"):
        if (path := folder / "masks" / name).is_file():
            return path
    return None


def no_mask(image: Path) -> CaptureError:
    """What to tell of an image without alpha for which there is no mask."""
    return CaptureError(
        f"{image.name} has neither alpha nor a mask",
        f"save it with alpha, or a mask as masks/{image.stem}.png (object white)",
    )


def _mask(folder: Path, image: Path, relative: object, where: str) -> Path | None:
    if relative is None:
        return find_mask(folder, image)
    if not isinstance(relative, str):
        raise CaptureError(f"{where} has a mask_path that is no text", "name the mask")
    return _find(folder, relative, where)


def _pose(matrix: Any, name: str) -> np.ndarray:
    """(3, 4) with an exact rotation: a uniform scale of the axes is dropped."""
    try:
        pose = np.array(matrix, np.float64)
    except (TypeError, ValueError, OverflowError):
        pose = np.zeros(0)
    if pose.shape not in ((4, 4), (3, 4)):
        raise CaptureError(f"{name} has no 4 x 4 transform_matrix", "give camera to world, row by row")
    if not np.abs(pose).max() < FARTHEST:
        raise CaptureError(f"{name} has a pose with NaN or huge numbers", "drop the frame or repair its pose")
    left, sizes, right = np.linalg.svd(pose[:3, :3])
    if not sizes[2] > (1.0 - ASPECT) * sizes[0]:
        raise CaptureError(f"{name} has a pose that is no rotation", "drop the frame or repair its pose")
    rotation = left @ right
    if np.linalg.det(rotation) < 0.0:
        raise CaptureError(f"{name} has a pose that mirrors", "flip an axis: x right, y up, looks along -z")
    return np.concatenate([rotation, pose[:3, 3:]], axis=1)


def _is_number(value: object) -> TypeGuard[float]:
    return isinstance(value, (int, float)) and not isinstance(value, bool) and abs(value) < 1e12
