"""From photos to the base shape: a coarse density, what is solid in it, and how thick the shell must be."""

from __future__ import annotations

import logging
import shutil
import time
from contextlib import suppress
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from mitex.cache import cached, content_key
from mitex.errors import CheckpointError
from mitex.mesh import Mesh
from mitex.methods.nerf.base.base_shape import base_shape, given_base, shell_thickness
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.config import NerfConfig, RadianceConfig
from mitex.methods.nerf.field.occupancy import sample_grid
from mitex.methods.nerf.field.projection import Projection
from mitex.methods.nerf.field.rendering import batch_rays
from mitex.methods.nerf.training.plain import PlainTask, train_plain_field
from mitex.paths import cache_dir
from mitex.runtime.jit import dr, mi
from mitex.textures.march import composite
from mitex.training.control import ALONE, Control

VERSION = 1  # of the base shapes in the cache
# Settings of the coarse field: it needs less of all this than the texture.
COARSE = RadianceConfig(
    preset="coarse",
    table=15,
    ray_steps=256,
    rays=1024,
    occupancy=64,
    average=0.8,
    preview_every=0,
)
GRID = 256  # samples of the density along a side of the scene cube
VIEWS = 16  # that the surface is scanned from
SCAN_SIDE = 200  # pixels of a scan along its longest side
SOLID = 0.95  # opacity of a ray that has met the surface
VOXEL = 0.01  # the scan keeps one point in each [scene units]
ABANDONED = 7 * 24 * 3600.0  # a training that nobody has gone on with for so long is removed [s]
log = logging.getLogger(__name__)


@dataclass(frozen=True, eq=False)
class BaseShape:
    """What the texture lies on.

    Attributes:
        mesh: in the scene cube.
        scan: (M, 3) float32 points of the captured surface.
        thickness: h, half of the shell's [scene units].
    """

    mesh: Mesh
    scan: np.ndarray
    thickness: float


def find_base(
    capture: Capture,
    config: NerfConfig,
    base_mesh: Mesh | None = None,
    control: Control = ALONE,
    keep: bool = True,
) -> BaseShape:
    """Trains a coarse field on a capture, and takes base shape, scan and thickness of the shell from it.

    Args:
        capture: the views to learn from.
        config: settings.
        base_mesh: a base shape of the user's in the scene cube; None takes it from the coarse field.
        control: is told of the steps of that training, and may stop it.
        keep: whether the result, and a training that is stopped, are kept in the user's cache folder.

    Raises:
        MeshError: there is nothing dense, or the given mesh cannot be used.
        Cancelled: by `control`.
    """
    coarse = coarse_config(config)
    arrays = (*capture.images, capture.poses, capture.intrinsics, capture.distortion)
    mesh = () if base_mesh is None else (base_mesh.vertices, base_mesh.faces)
    folder = cache_dir() / "nerf"
    # A training goes on under equal configs only, so its folder is named by all that is in them.
    training = folder / f"{content_key(VERSION, *arrays, capture.name, coarse)}.run"
    settings = (config.concavity, config.repulsion, config.neighbours)
    place = folder / content_key(VERSION, *arrays, *mesh, coarse, *settings)

    def compute() -> BaseShape:
        base = None if base_mesh is None else given_base(base_mesh)  # which may be refused
        task = _trained(coarse, capture, training if keep else None, control)
        if base is None:
            log.info("cutting the base shape out of the coarse field, about a minute")
            base = _shape_of(task, config)
        scan = scan_surface(task)
        projection = Projection(base, neighbours=config.neighbours, repulsion=config.repulsion)
        return BaseShape(base, scan, shell_thickness(scan, projection))

    base = cached(place, compute, _read, _write, keep)
    if keep:
        shutil.rmtree(training, ignore_errors=True)
        _remove_abandoned(folder)
    log.info("base shape of %s faces, shell of +-%.3f", f"{len(base.mesh.faces):,}", base.thickness)
    return base


def coarse_config(config: NerfConfig) -> RadianceConfig:
    """Settings of the coarse field. Of a fit's settings they depend on seed, `lr` and `base_steps` alone, so
    that a fit with others finds its base shape in the cache."""
    steps = config.base_steps
    return replace(COARSE, seed=config.seed, lr=config.lr, steps=steps, lr_steps=steps)


def _trained(coarse: RadianceConfig, capture: Capture, folder: Path | None, control: Control) -> PlainTask:
    """The coarse field; an interrupted training goes on, unless its checkpoints cannot be used."""
    try:
        return train_plain_field(coarse, capture, (capture, 0), folder, control)
    except CheckpointError:
        if folder is not None:
            shutil.rmtree(folder)
        return train_plain_field(coarse, capture, (capture, 0), folder, control)


def _remove_abandoned(folder: Path) -> None:
    """Removes interrupted trainings that nobody has gone on with for a week."""
    for training in folder.glob("*.run"):
        with suppress(OSError):
            if time.time() - training.stat().st_mtime > ABANDONED:
                shutil.rmtree(training)


def _shape_of(task: PlainTask, config: NerfConfig) -> Mesh:
    """The base shape of a trained coarse field."""
    occupied = task.occupancy.occupied.astype(bool)
    density = sample_grid(task.field(task.mean).density_at, occupied, GRID)
    return base_shape(density, concavity=config.concavity)


def scan_surface(task: PlainTask) -> np.ndarray:
    """(M, 3) float32 points where rays of views from all around become solid."""
    field = task.field(task.mean)
    points = []
    for view in _farthest(task.pixels.capture.poses[:, :, 3], VIEWS):
        batch, _ = task.pixels.image(int(view), SCAN_SIDE)
        origin, direction = batch_rays(batch)
        pixels = composite(field, origin, direction, dr.full(mi.Float, 0.5, dr.width(origin)))
        opacity = 1 - np.array(pixels.transmittance)
        solid = opacity > SOLID
        depth = (np.array(pixels.depth)[solid] / opacity[solid])[:, None]
        points.append(batch.origins[solid] + batch.directions[solid] * depth)
    points = np.concatenate(points)
    _, first = np.unique(np.floor(points / VOXEL).astype(np.int64), axis=0, return_index=True)
    return points[np.sort(first)].astype(np.float32)


def _farthest(points: np.ndarray, count: int) -> np.ndarray:
    """Indices of `count` points, the first and then always the one farthest from those before it."""
    index = [0]
    distance = np.linalg.norm(points - points[0], axis=1)
    for _ in range(min(count, len(points)) - 1):
        index.append(int(distance.argmax()))
        distance = np.minimum(distance, np.linalg.norm(points - points[index[-1]], axis=1))
    return np.array(index)


def _read(place: Path) -> BaseShape:
    with np.load(place / "base.npz", allow_pickle=False) as file:
        mesh = Mesh(file["vertices"], file["faces"], name="base")
        return BaseShape(mesh, file["scan"], float(file["thickness"]))


def _write(folder: Path, base: BaseShape) -> None:
    mesh, thickness = base.mesh, np.float64(base.thickness)
    np.savez(
        folder / "base.npz", vertices=mesh.vertices, faces=mesh.faces, scan=base.scan, thickness=thickness
    )
