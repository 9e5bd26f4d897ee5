"""A capture and a mesh: how near textures on planes come to the photos (Huang et al. 2023, table 2), and the
captured object to photos that were held out (table 1)."""

from __future__ import annotations

from dataclasses import asdict
from functools import cached_property
from pathlib import Path
from typing import Protocol, runtime_checkable

import numpy as np

from mitex.asset import Asset
from mitex.cache import content_key
from mitex.comparison.inputs import CELL, lit_picture, mesh_of, read_once
from mitex.comparison.results import LIT, VIEW
from mitex.evaluation.elevations import Renderer, photo_distances, plane_distances
from mitex.evaluation.views import view_quality
from mitex.evaluation.windows import PLACES, WINDOW, Window, select_windows
from mitex.methods.nerf.base.coarse import BaseShape, find_base
from mitex.methods.nerf.capture.capture import Capture, load_capture
from mitex.methods.nerf.capture.pixels import Pixels
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field.raycast import Raycaster
from mitex.methods.nerf.field.rendering import render_view, render_views
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

    def in_place(self) -> RadianceField:
        """The captured object, in the scene cube of the capture."""
        ...


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
    """A capture and a mesh, or a capture alone for what is put on no mesh.

    Args:
        exemplar: folder of the capture.
        mesh: path or name.
    """

    judge = None

    def __init__(self, exemplar: str, mesh: str | None) -> None:
        self.folder, self.capture = exemplar, capture_of(exemplar)
        self.mesh = None if mesh is None else mesh_of(mesh)

    @property
    def key(self) -> str:
        """A hash of both."""
        shape = () if self.mesh is None else (self.mesh.vertices, self.mesh.faces)
        return content_key(self.capture.metadata()["capture_key"], *shape)

    @property
    def image(self) -> np.ndarray:
        """The first photo that is held out, on a white square."""
        batch, shape = Pixels(self._held_out).image(0, CELL)
        photo = batch.colours * batch.alpha + 1 - batch.alpha
        return _squared(photo.numpy().reshape(*shape, 3))

    def numbers(self, asset: Asset | None, run: Path) -> dict[str, float]:
        """Distances on planes, and likeness of views that were held out, as far as the texture has them."""
        texture, numbers = load(run), {}
        if isinstance(texture, LaidFlat):
            render = texture.on_plane(self._along)
            numbers |= _named(plane_distances(windows_of(self.folder), render))
        if isinstance(texture, Captured):
            numbers |= asdict(view_quality(render_views(texture.in_place(), self._held_out)))
        return numbers

    def floor(self) -> dict[str, float]:
        """The distances of other photos: the least that is to be expected; nothing for a capture alone."""
        return {} if self.mesh is None else _named(photo_distances(windows_of(self.folder)))

    def pictures(self, asset: Asset | None, run: Path) -> dict[str, np.ndarray]:
        """As of `mitex.comparison.inputs.lit_picture`, and the captured object in the view of `image`."""
        texture, pictures = load(run), {}
        if asset is not None:
            pictures[LIT] = lit_picture(asset, self.mesh)
        if isinstance(texture, Captured):
            pictures[VIEW] = _squared(render_view(texture.in_place(), self._held_out, 0, CELL)[0])
        return pictures

    @property
    def _held_out(self) -> Capture:
        return self.capture.split()[1]

    @cached_property
    def _along(self) -> np.ndarray:
        return principal_direction(base_of(self.folder).mesh)


def _squared(picture: np.ndarray) -> np.ndarray:
    """A picture (H, W, 3) in the middle of a white square."""
    height, width, _ = picture.shape
    square = np.ones((max(height, width),) * 2 + (3,), np.float32)
    square[(len(square) - height) // 2 :, (len(square) - width) // 2 :][:height, :width] = picture
    return square


def _named(distances: dict[float, float]) -> dict[str, float]:
    """By the measures' keys, with their mean; nothing of photos that show no angle well enough."""
    numbers = {f"plane_{angle:g}": distance for angle, distance in distances.items()}
    return numbers | ({"planes": float(np.mean(list(numbers.values())))} if numbers else {})
