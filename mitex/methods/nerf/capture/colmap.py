"""Cameras of plain photos: structure from motion by COLMAP (extra `nerf`)."""

from __future__ import annotations

import hashlib
import json
import tempfile
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from PIL import Image

from mitex.cache import cached, content_key
from mitex.errors import CaptureError, CaptureWarning
from mitex.images import SUFFIXES, read_bytes
from mitex.methods.nerf.capture.transforms import ONE_FILE, Frame, find_mask, no_mask, parse_frames
from mitex.optional import optional
from mitex.paths import cache_dir
from mitex.progress import announce
from mitex.runtime.workers import allowed

if TYPE_CHECKING:
    import pycolmap

MIN_PHOTOS = 8
PLACED = 0.5  # part of the photos that must get a pose
FIRST_PAIR = 50, 8.0  # matches, and angle [degrees], that the first two photos need
FURTHER = 20  # matches that a further photo needs
LONGER_SIDE = 1600  # of what COLMAP sees [pixels]
VERSION = 1  # of the cached poses


@dataclass(frozen=True, eq=False)
class Structure:
    """What structure from motion finds.

    Attributes:
        tree: content of a `transforms.json`, with the `V` photos that have a camera.
        points: (P, 3) float64, of surfaces that photos show, in the cameras' world.
        sightings: (S, 2) int64 indices of a photo and of a point that was matched in it.
    """

    tree: dict[str, Any]
    points: np.ndarray = field(default_factory=lambda: np.zeros((0, 3)))
    sightings: np.ndarray = field(default_factory=lambda: np.zeros((0, 2), np.int64))


def photo_frames(folder: Path) -> list[Frame]:
    """The photos in a folder, or in its `images/`, with the cameras that COLMAP finds.

    That takes minutes; the poses are kept in the user's cache as a `transforms.json`, under a hash of the
    photos. Nothing is written into the folder. Photos without a pose are left out with a warning.

    Raises:
        CaptureError: too few photos, or too few of them overlap.
        ImageError: a photo is damaged.
        MissingPackage: pycolmap is not installed.
    """
    try:
        photos = _photos(folder)
        contents = [hashlib.sha256(path.read_bytes()).hexdigest() for path in photos]
    except OSError as error:
        raise CaptureError(f"{folder} cannot be read ({error.strerror})", "check its permissions") from error
    if len(photos) < MIN_PHOTOS:
        raise CaptureError(
            f"{folder} has no transforms.json, and {len(photos)} photos",
            f"give {MIN_PHOTOS} or more PNG or JPEG files that overlap, or the cameras in a transforms.json",
        )
    names = [path.relative_to(folder).as_posix() for path in photos]
    place = cache_dir() / "captures" / content_key(VERSION, LONGER_SIDE, names, contents)
    tree = cached(place, lambda: _reconstruct(folder, names), _read, _write)
    missing = len(names) - len(tree["frames"])
    if missing:
        text = f"{folder}: {missing} of {len(names)} photos could not be placed and are left out"
        warnings.warn(text, CaptureWarning, stacklevel=2)
    return parse_frames(tree, folder, "COLMAP")


def _photos(folder: Path) -> list[Path]:
    source = folder / "images" if (folder / "images").is_dir() else folder
    return sorted(path for path in source.iterdir() if path.suffix.lower() in SUFFIXES and path.is_file())


def _reconstruct(folder: Path, names: Sequence[str]) -> dict[str, Any]:
    """The content of a `transforms.json` for those photos that COLMAP places in one world."""
    return reconstruct(folder, names, masked=True).tree


def reconstruct(folder: Path, names: Sequence[str], masked: bool = False) -> Structure:
    """Cameras and points of the photos `names` in `folder`; takes minutes.

    Args:
        folder: of the photos.
        names: paths relative to it.
        masked: whether photos must have an alpha channel or a mask.

    Raises:
        CaptureError: too few of them could be placed, or one has no mask.
        ImageError: a photo is damaged.
        MissingPackage: pycolmap is not installed.
    """
    announce("finding the cameras, minutes to hours")
    with tempfile.TemporaryDirectory(prefix="mitex-") as temporary:
        work = Path(temporary)
        (work / "images").mkdir()
        # COLMAP sees copies: upright as `read_bytes` gives them, and no larger than it needs.
        copies = {f"{k:05}.png": name for k, name in enumerate(names)}
        sizes = {copy: _copy(folder, name, work / "images" / copy, masked) for copy, name in copies.items()}
        model = _largest(work, one_camera=len(set(sizes.values())) == 1)
        placed = {} if model is None else {i.name: i for i in model.images.values() if i.has_pose}
        if model is None or len(placed) < max(MIN_PHOTOS, PLACED * len(names)):
            raise CaptureError(
                f"only {len(placed)} of {len(names)} photos could be placed",
                "take sharp, overlapping photos all around a textured object, before a still background",
            )
        images = [placed[name] for name in sorted(placed)]
        frames = [_frame(copies[image.name], image, sizes[image.name]) for image in images]
        tree = {"camera_model": "OPENCV", "frames": frames}
        return Structure(tree, *_points(model, images))


def _copy(folder: Path, name: str, target: Path, masked: bool) -> tuple[int, int]:
    """Writes a photo without alpha, scaled down where it is large; gives its own width and height."""
    pixels = read_bytes(folder / name)
    if masked and pixels.shape[2] == 3 and find_mask(folder, folder / name) is None:
        raise no_mask(folder / name)  # before it takes minutes
    image = Image.fromarray(np.ascontiguousarray(pixels[..., :3]))
    size = image.size
    image.thumbnail((LONGER_SIDE, LONGER_SIDE), Image.Resampling.LANCZOS)
    image.save(target, compress_level=1)
    return size


def _largest(work: Path, one_camera: bool) -> pycolmap.Reconstruction | None:
    """COLMAP's model with the most photos, or None; always the same for the same photos."""
    colmap = optional("pycolmap", "nerf")
    level, colmap.logging.minloglevel = colmap.logging.minloglevel, colmap.logging.FATAL
    threads = allowed() or -1  # which is all
    extraction, matching = colmap.FeatureExtractionOptions(), colmap.FeatureMatchingOptions()
    extraction.num_threads = matching.num_threads = threads
    verification = colmap.TwoViewGeometryOptions()
    verification.ransac.random_seed = 0
    mapping = colmap.IncrementalPipelineOptions()
    mapping.random_seed, mapping.min_model_size, mapping.num_threads = 0, MIN_PHOTOS, threads
    # COLMAP's own limits are for large photos: small, noisy frames of a video have fewer matches.
    mapping.mapper.init_min_num_inliers, mapping.mapper.init_min_tri_angle = FIRST_PAIR
    mapping.mapper.abs_pose_min_num_inliers = FURTHER
    mode = colmap.CameraMode.SINGLE if one_camera else colmap.CameraMode.PER_IMAGE
    database, images, models = work / "database.db", work / "images", work / "models"
    models.mkdir()
    try:
        colmap.set_random_seed(0)
        device = colmap.Device.cpu
        colmap.extract_features(
            database, images, camera_mode=mode, extraction_options=extraction, device=device
        )
        colmap.match_exhaustive(database, matching, verification_options=verification, device=device)
        reconstructions = colmap.incremental_mapping(database, images, models, mapping)
    except (RuntimeError, ValueError) as error:
        reason = " ".join(str(error).split())
        raise CaptureError(f"COLMAP failed ({reason})", "find the cameras with another program") from error
    finally:
        colmap.logging.minloglevel = level
    return max(reconstructions.values(), key=lambda model: model.num_reg_images(), default=None)


def _frame(name: str, image: pycolmap.Image, size: tuple[int, int]) -> dict[str, Any]:
    """An entry of `transforms.json`; COLMAP's cameras look along +z, y down, and map world to camera."""
    camera, width, height = image.camera, *size
    assert camera is not None  # all images of a reconstruction have one
    x, y = width / camera.width, height / camera.height
    matrix = image.cam_from_world().matrix()
    rotation = matrix[:, :3].T
    pose = np.column_stack([rotation * (1.0, -1.0, -1.0), -rotation @ matrix[:, 3]])
    (radial,) = (camera.params[k] for k in camera.extra_params_idxs())
    return {
        "file_path": name,
        "w": width,
        "h": height,
        "fl_x": camera.focal_length * x,
        "fl_y": camera.focal_length * y,
        "cx": camera.principal_point_x * x,
        "cy": camera.principal_point_y * y,
        "k1": float(radial),
        "transform_matrix": [*pose.tolist(), [0.0, 0.0, 0.0, 1.0]],
    }


def _points(
    model: pycolmap.Reconstruction, images: Sequence[pycolmap.Image]
) -> tuple[np.ndarray, np.ndarray]:
    """Points of the model, (P, 3) float64, and which are seen in which of the images, (S, 2) int64."""
    index = {identity: k for k, identity in enumerate(model.points3D)}
    sightings = [
        (view, index[place.point3D_id])
        for view, image in enumerate(images)
        for place in image.get_observation_points2D()
    ]
    points = np.array([point.xyz for point in model.points3D.values()], np.float64)
    return points.reshape(-1, 3), np.array(sightings, np.int64).reshape(-1, 2)


def _read(place: Path) -> dict[str, Any]:
    return json.loads((place / ONE_FILE).read_text())


def _write(place: Path, tree: Mapping[str, Any]) -> None:
    (place / ONE_FILE).write_text(json.dumps(tree, indent=1) + "\n")
