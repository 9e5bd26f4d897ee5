"""The site of a capture: pictures with their cameras, sparse points, and which way is up."""

from __future__ import annotations

import hashlib
import json
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np

from mitex.cache import cached, content_key
from mitex.geometry.vectors import unit
from mitex.methods.nerf.capture.colmap import LONGER_SIDE, Structure, reconstruct
from mitex.methods.nerf.capture.transforms import ONE_FILE, Frame, parse_frames
from mitex.methods.nerf.capture.visual_hull import View, looked_at
from mitex.paths import cache_dir

VERSION = 1  # of what is cached


@dataclass(frozen=True, eq=False)
class Site:
    """`V` pictures that have a camera. The world is that of COLMAP, turned so that z is up.

    Attributes:
        frames: the pictures' files and cameras.
        views: (V,) the cameras, with masks that are empty.
        points: (P, 3) float64 on surfaces of object and surroundings.
        sightings: (S, 2) int64 indices of a view and of a point that was matched in it.
    """

    frames: Sequence[Frame]
    views: Sequence[View]
    points: np.ndarray
    sightings: np.ndarray

    @cached_property
    def cameras(self) -> np.ndarray:
        """(V, 3) where the cameras stand."""
        return np.stack([view.pose[:, 3] for view in self.views])

    @cached_property
    def middle(self) -> np.ndarray:
        """(3,) what the cameras look at."""
        return looked_at(np.stack([view.pose for view in self.views]))

    @cached_property
    def distance(self) -> float:
        """Of most cameras from the middle, the measure of all lengths."""
        return float(np.median(np.linalg.norm(self.cameras - self.middle, axis=1)))

    def seen(self, view: int) -> np.ndarray:
        """Indices of the points that were matched in a view."""
        return self.sightings[self.sightings[:, 0] == view, 1]


def find_site(folder: Path, names: Sequence[str]) -> Site:
    """Cameras and points of pictures in a folder; takes minutes, and is kept in the user's cache.

    Raises:
        CaptureError: too few of them could be placed.
        MissingPackage: pycolmap is not installed.
    """
    contents = [hashlib.sha256((folder / name).read_bytes()).hexdigest() for name in names]
    place = cache_dir() / "captures" / content_key("site", VERSION, LONGER_SIDE, names, contents)
    structure = cached(place, lambda: reconstruct(folder, names), _read, _write)
    return upright(structure, folder)


def upright(structure: Structure, folder: Path) -> Site:
    """The site with z up."""
    frames = parse_frames(structure.tree, folder, "COLMAP")
    turn = to_upright(np.stack([frame.pose for frame in frames]))
    turned = [_turned(frame, turn) for frame in frames]
    views = []
    for frame in turned:
        width, height = (int(str(frame.lens[key])) for key in ("w", "h"))
        views.append(View(np.zeros((height, width), bool), frame.pose, *frame.intrinsics(width, height)))
    return Site(turned, views, structure.points @ turn.T, structure.sightings)


def to_upright(poses: np.ndarray) -> np.ndarray:
    """The rotation (3, 3) of the world that brings z up: pictures were taken with a level horizon.

    Up is what the cameras' x axes, which are level, are least along, towards the tops of the pictures.

    Args:
        poses: (V, 3, 4) camera -> world.
    """
    right, top = poses[:, :, 0], poses[:, :, 1]
    up = np.linalg.eigh(right.T @ right)[1][:, 0]
    up = up * (1.0 if (top @ up).sum() > 0.0 else -1.0)
    back = poses[0, :, 2] - (poses[0, :, 2] @ up) * up  # the first camera stands on the x axis
    x = unit(back if np.linalg.norm(back) > 1e-6 else np.cross(up, np.eye(3)[np.abs(up).argmin()]))
    return np.stack([x, np.cross(up, x), up])


def _turned(frame: Frame, turn: np.ndarray) -> Frame:
    return Frame(frame.name, frame.image, frame.mask, turn @ frame.pose, frame.lens)


def _read(place: Path) -> Structure:
    with np.load(place / "points.npz", allow_pickle=False) as arrays:
        points, sightings = arrays["points"], arrays["sightings"]
    return Structure(_tree(place), points, sightings)


def _tree(place: Path) -> dict[str, Any]:
    return json.loads((place / ONE_FILE).read_text())


def _write(place: Path, structure: Structure) -> None:
    (place / ONE_FILE).write_text(json.dumps(structure.tree, indent=1) + "\n")
    np.savez(place / "points.npz", points=structure.points, sightings=structure.sightings)
