"""A capture and a mesh: how near textures on planes come to the photos (Huang et al. 2023, table 2)."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from mitex.asset import Asset
from mitex.cache import content_key
from mitex.comparison.inputs import CELL, lit, mesh_of, read_once
from mitex.evaluation.elevations import Renderer, photo_distances, plane_distances
from mitex.evaluation.metrics import psnr, ssim
from mitex.evaluation.windows import PLACES, WINDOW, Window, select_windows
from mitex.methods.nerf.base.coarse import BaseShape, find_base
from mitex.methods.nerf.capture.capture import Capture, load_capture
from mitex.methods.nerf.capture.pixels import Pixels
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field.raycast import Raycaster
from mitex.methods.nerf.field.rendering import render_views
from mitex.methods.nerf.synthesis.patches import principal_direction
from mitex.methods.registry import load
from mitex.runtime import init
from mitex.textures.march import RadianceField


@runtime_checkable
class LaidFlat(Protocol):
    """A texture that can be looked at on a plane."""

    def on_plane(self, along: np.ndarray) -> Renderer:
        """What shows it in the windows of photos, on planes whose x follows a direction (3,) of the scene."""
        ...


@runtime_checkable
class Captured(Protocol):
    """A texture that can be looked at where it was captured."""

    @property
    def shell(self) -> RadianceField: ...


@read_once
def capture_of(folder: str) -> Capture:
    """A capture by its path.

    Raises:
        CaptureError, ImageError: It cannot be read.
    """
    return load_capture(folder)


@read_once
def base_of(folder: str) -> BaseShape:
    """The base shape of a capture, which fits with the default settings have left in the cache."""
    init(needs="ad")
    return find_base(capture_of(folder).split()[0], NerfConfig())


@read_once
def windows_of(folder: str) -> dict[float, list[Window]]:
    """Windows of a capture's photos, by angle."""
    capture, rng = capture_of(folder), np.random.default_rng(0)
    raycaster = Raycaster(base_of(folder).mesh, capture)
    surfaces = [raycaster(view) for view in range(len(capture))]
    return select_windows(capture, surfaces, rng, WINDOW, PLACES)


class CapturePair:
    """A capture and a mesh.

    Args:
        exemplar: folder of the capture.
        mesh: path or name.
    """

    judge = None

    def __init__(self, exemplar: str, mesh: str) -> None:
        self.folder, self.capture, self.mesh = exemplar, capture_of(exemplar), mesh_of(mesh)

    @property
    def key(self) -> str:
        """A hash of both."""
        photos = self.capture.metadata()["capture_key"]
        return content_key(photos, self.mesh.vertices, self.mesh.faces)

    @property
    def image(self) -> np.ndarray:
        """The first photo, on a white square."""
        batch, (height, width) = Pixels(self.capture).image(0, CELL)
        photo = (batch.colours * batch.alpha + 1 - batch.alpha).numpy().reshape(height, width, 3)
        square = np.ones((max(height, width),) * 2 + (3,), np.float32)
        square[(len(square) - height) // 2 :, (len(square) - width) // 2 :][:height, :width] = photo
        return square

    def numbers(self, asset: Asset, run: Path) -> dict[str, float]:
        """Distances on planes, and likeness of views that were held out, as far as the texture has them."""
        texture, numbers = load(run), {}
        if isinstance(texture, LaidFlat):
            render = texture.on_plane(self._along)
            numbers |= _named(plane_distances(windows_of(self.folder), render))
        if isinstance(texture, Captured):
            views = list(render_views(texture.shell, self.capture.split()[1]))
            for name, measure in (("psnr", psnr), ("ssim", ssim)):
                numbers[name] = float(np.mean([measure(*pair) for pair in views]))
        return numbers

    def floor(self) -> dict[str, float]:
        """The distances of other photos: the least that is to be expected."""
        return _named(photo_distances(windows_of(self.folder)))

    def picture(self, asset: Asset) -> np.ndarray:
        """As of `mitex.comparison.inputs.lit`."""
        return lit(asset, self.mesh)

    @cached_property
    def _along(self) -> np.ndarray:
        return principal_direction(base_of(self.folder).mesh)


def _named(distances: dict[float, float]) -> dict[str, float]:
    """By the measures' keys, with their mean."""
    numbers = {f"plane_{angle:g}": distance for angle, distance in distances.items()}
    return numbers | {"planes": float(np.mean(list(distances.values())))}
