"""Captures: photos with masks and cameras, moved into the scene cube [-1, 1]^3."""

from __future__ import annotations

import hashlib
import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path

import numpy as np

from mitex.cache import content_key
from mitex.errors import CaptureError, CaptureWarning
from mitex.geometry.vectors import unit
from mitex.images import read_bytes, read_image
from mitex.mesh import Similarity
from mitex.methods.nerf.capture.colmap import photo_frames
from mitex.methods.nerf.capture.distortion import folds, undistort
from mitex.methods.nerf.capture.transforms import Frame, no_mask, read_frames, transforms_files
from mitex.methods.nerf.capture.visual_hull import Hull, View, project, visual_hull
from mitex.paths import encodable, expanded
from mitex.progress import announce, counted

MIN_VIEWS = 8
HALF_EXTENT = 0.75  # of the visual hull in the scene cube
MAX_PIXELS = 400_000_000  # of all images: 1.6 GB
OPAQUE = 128  # alpha of the object in a mask


@dataclass(frozen=True, eq=False)
class Capture:
    """`N` photos of an object in the scene cube. Camera axes: x right, y up, looks along -z.

    Attributes:
        images: (H, W, 4) uint8 each, sRGB with straight alpha, which is the mask; sizes may differ.
        poses: (N, 3, 4) float32 camera -> scene cube, rotation orthonormal.
        intrinsics: (N, 4) float32 fx, fy, cx, cy [pixels]; pixel centres are at +0.5.
        distortion: (N, 4) float32 k1, k2, p1, p2 of OpenCV's lens model.
        names: of the image files, relative to the capture's folder.
        similarity: the capture's world -> scene cube.
        name: for messages.
    """

    images: tuple[np.ndarray, ...]
    poses: np.ndarray
    intrinsics: np.ndarray
    distortion: np.ndarray
    names: tuple[str, ...]
    similarity: Similarity
    name: str = "capture"

    def __len__(self) -> int:
        return len(self.images)

    def metadata(self) -> dict[str, str]:
        """Name, and a hash of photos and cameras, for the metadata of a training."""
        return {"capture": self.name, "capture_key": self._key}

    @cached_property
    def _key(self) -> str:
        return content_key(*self.images, self.poses, self.intrinsics, self.distortion)

    def rays(self, view: int | np.ndarray, pixels: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Rays through positions in an image, without the lens's distortion.

        Args:
            view: index of the image, or one for each pixel, (P,).
            pixels: (P, 2) column and row [pixels]; the centre of the first pixel is (0.5, 0.5).

        Returns:
            Origins and unit directions in the scene cube, (P, 3) float32 each.
        """
        camera = self.intrinsics[view].astype(np.float64)
        ideal = undistort((pixels - camera[..., 2:]) / camera[..., :2], self.distortion[view])
        local = unit(np.stack([ideal[:, 0], -ideal[:, 1], np.full(len(ideal), -1.0)], axis=1))
        pose = self.poses[view]
        directions = np.einsum("...ij,...j->...i", pose[..., :3], local)
        origins = np.broadcast_to(pose[..., 3], directions.shape)
        return np.ascontiguousarray(origins, np.float32), directions.astype(np.float32)

    def project(self, view: int, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where points (P, 3) of the scene cube are seen; the inverse of `rays`.

        Returns:
            (P, 2) column and row [pixels], and (P,) depth along the optical axis, positive in front; float64.
        """
        return project(points, self.poses[view], self.intrinsics[view], self.distortion[view])

    def split(self, every: int = 8) -> tuple[Capture, Capture]:
        """Views to learn from, and every `every`-th, which is held out."""
        test = np.arange(len(self)) % every == 0
        return self._subset(np.flatnonzero(~test)), self._subset(np.flatnonzero(test))

    def within(self, similarity: Similarity) -> Capture:
        """The same photos in another scene cube, such as the one that a texture was learned in."""
        poses = self.poses.astype(np.float64)
        poses[:, :, 3] = similarity.apply(self.similarity.inverse(poses[:, :, 3]))
        return replace(self, poses=poses.astype(np.float32), similarity=similarity)

    def _subset(self, index: np.ndarray) -> Capture:
        return replace(
            self,
            images=tuple(self.images[k] for k in index),
            poses=self.poses[index],
            intrinsics=self.intrinsics[index],
            distortion=self.distortion[index],
            names=tuple(self.names[k] for k in index),
        )


def load_capture(folder: str | Path) -> Capture:
    """Loads a folder with `transforms.json` (instant-ngp) or `transforms_train.json` (NeRF-synthetic).

    Without one the cameras of the photos in it are found by COLMAP, which takes minutes the first time.
    Masks are the images' alpha, files named by `mask_path`, or `masks/NAME.png`. The scene cube is chosen
    such that the bounding box of the visual hull is centred in it, its largest half extent 0.75. A view that
    is there twice is dropped with a warning.

    Raises:
        CaptureError: the folder, its files, poses, lenses or masks cannot be used, or there are too few.
        ImageError: an image is missing, damaged or not a PNG or JPEG.
    """
    folder = expanded(folder)
    if not os.path.isdir(folder):
        raise CaptureError(f"{folder} is not a folder", "give the folder of a capture")
    files = transforms_files(folder)
    frames = [frame for path in files for frame in read_frames(path)] if files else photo_frames(folder)
    return assemble(frames, encodable(folder.resolve().name))


def assemble(frames: Sequence[Frame], name: str) -> Capture:
    """Reads the images of the frames and moves everything into the scene cube; raises as `load_capture`."""
    frames, images = _read_images(frames)
    if len(frames) < MIN_VIEWS:
        raise CaptureError(
            f"{name} has {len(frames)} different views", f"take {MIN_VIEWS} or more, better 60 to 100"
        )
    lenses = [f.intrinsics(i.shape[1], i.shape[0]) for f, i in zip(frames, images, strict=True)]
    views = [View(object_mask(i), f.pose, *lens) for f, i, lens in zip(frames, images, lenses, strict=True)]
    for frame, view in zip(frames, views, strict=True):
        _check_lens(frame, view)
    _check_masks(frames, views)
    similarity = _scene_cube(frames, views)
    poses = np.stack([frame.pose for frame in frames])
    poses[:, :, 3] = similarity.apply(poses[:, :, 3])
    return Capture(
        images=tuple(images),
        poses=poses.astype(np.float32),
        intrinsics=np.stack([k for k, _ in lenses]).astype(np.float32),
        distortion=np.stack([d for _, d in lenses]).astype(np.float32),
        names=tuple(frame.name for frame in frames),
        similarity=similarity,
        name=name,
    )


def _read_images(frames: Sequence[Frame]) -> tuple[list[Frame], list[np.ndarray]]:
    """All images as RGBA, without views that were there before."""
    unique, images, total = [], [], 0
    names_by_key: dict[bytes, str] = {}
    for frame in counted("reading photos", frames, len(frames)):
        image = _rgba(frame)
        key = hashlib.sha256(frame.pose.tobytes() + image.tobytes()).digest()
        if key in names_by_key:
            text = f"{frame.name} is the view {names_by_key[key]} again; it is left out"
            warnings.warn(text, CaptureWarning, stacklevel=2)
            continue
        names_by_key[key] = frame.name
        unique.append(frame)
        images.append(image)
        total += image.shape[0] * image.shape[1]
        if total > MAX_PIXELS:
            raise CaptureError(
                f"the images up to {frame.name} have over {MAX_PIXELS // 10**6} megapixels",
                "scale them down, and w, h, fl_x, fl_y, cx, cy with them",
            )
    return unique, images


def _rgba(frame: Frame) -> np.ndarray:
    """(H, W, 4) uint8, the mask as alpha."""
    image = read_bytes(frame.image)
    if frame.mask is None:
        if image.shape[2] == 3:
            raise no_mask(frame.image)
        return image
    mask = np.round(read_image(frame.mask, "L") * 255.0).astype(np.uint8)
    if mask.shape[:2] != image.shape[:2]:
        raise CaptureError(
            f"{frame.mask.name} is {mask.shape[1]} x {mask.shape[0]}, its image {frame.name} "
            f"{image.shape[1]} x {image.shape[0]} pixels",
            "make both of one size",
        )
    return np.concatenate([image[..., :3], mask], axis=2)


def object_mask(image: np.ndarray) -> np.ndarray:
    """(H, W) bool, where an RGBA image (H, W, 4) uint8 shows the object."""
    return image[..., 3] >= OPAQUE


def _check_lens(frame: Frame, view: View) -> None:
    height, width = view.mask.shape
    x, y = np.meshgrid(np.linspace(0.0, width, 9), np.linspace(0.0, height, 9))
    points = (np.stack([x, y], axis=-1) - view.intrinsics[2:]) / view.intrinsics[:2]
    if folds(points, view.distortion):
        raise CaptureError(
            f"{frame.name} has a distortion that cannot be undone", "undistort the images beforehand"
        )


def _check_masks(frames: Sequence[Frame], views: Sequence[View]) -> None:
    empty = [f.name for f, view in zip(frames, views, strict=True) if not view.mask.any()]
    if len(empty) == len(views):
        raise CaptureError("all masks are empty", "make them white (or the alpha opaque) on the object")
    if empty:
        others = f" and {len(empty) - 1} more" if len(empty) > 1 else ""
        raise CaptureError(f"the mask of {empty[0]}{others} is empty", "drop the view or mend its mask")
    if all(view.mask.all() for view in views):
        raise CaptureError("no mask leaves any background", "cut the object out: transparent around it")


def _scene_cube(frames: Sequence[Frame], views: Sequence[View]) -> Similarity:
    """The map that puts the visual hull into the scene cube."""
    announce("carving the visual hull")
    hull = visual_hull(views)
    if hull is None:
        raise CaptureError(
            "the masks agree on no object",
            "check that the poses belong to the images, and that all cameras look at the object",
        )
    _check_outside(frames, hull)
    low, high = hull.bounds()
    return Similarity(0.5 * (low + high), float(0.5 * (high - low).max() / HALF_EXTENT))


def _check_outside(frames: Sequence[Frame], hull: Hull) -> None:
    within = hull.contains(np.stack([frame.pose[:, 3] for frame in frames]))
    if within.any():
        name = frames[int(np.flatnonzero(within)[0])].name
        raise CaptureError(f"the camera of {name} is inside the object", "drop the view or mend its pose")
