"""An exemplar and a mesh: how near the colours of textures on the mesh come to the exemplar."""

from __future__ import annotations

import logging
from dataclasses import asdict
from functools import cached_property
from pathlib import Path

import numpy as np

from mitex.asset import Asset, clay
from mitex.cache import content_key
from mitex.comparison.inputs import lit_picture, mesh_of, read_once
from mitex.comparison.results import LIT
from mitex.errors import ImageError
from mitex.evaluation.likeness import Vectors, exemplar_patches, likeness, patch_features
from mitex.evaluation.patches import albedo_views, patch_cameras
from mitex.evaluation.regularity import regularity
from mitex.evaluation.seams import seam_ratio
from mitex.exemplar import Exemplar
from mitex.mesh import Mesh
from mitex.methods.layout import EXEMPLAR_WIDTH, RESOLUTION, layout_side, with_layout
from mitex.scenes.cameras import Cameras

log = logging.getLogger(__name__)

SIDE = 256  # of the exemplar, at most [px]
PATCHES, SHARE = 16, 0.375  # patches, and their width [widths of the exemplar]
WINDOWS = 6  # as wide as the exemplar, for the repetition; shifts go up to half of that


@read_once
def picture_of(exemplar: str) -> np.ndarray:
    """The central square of an exemplar's albedo, (S, S, 3) sRGB in [0, 1], at most `SIDE` wide.

    Raises:
        ImageError: It cannot be read, or has no albedo.
    """
    source = Exemplar.load(exemplar).of_albedo()
    return source.resized(min(SIDE, *source.size)).maps["albedo"]


@read_once
def sized_mesh(mesh: str) -> tuple[Mesh, float]:
    """A mesh, and how wide the exemplar is on it [mesh units].

    Raises:
        MeshError: It cannot be read.
    """
    loaded = mesh_of(mesh)
    return loaded, EXEMPLAR_WIDTH * layout_side(with_layout(loaded, RESOLUTION))


class LookPair:
    """An exemplar and a mesh.

    Args:
        exemplar, mesh: paths or names.
    """

    judge = None

    def __init__(self, exemplar: str, mesh: str) -> None:
        self.image = picture_of(exemplar)
        self.mesh, self.width = sized_mesh(mesh)

    @property
    def key(self) -> str:
        """A hash of both."""
        return content_key(self.image, self.mesh.vertices, self.mesh.faces)

    def numbers(self, asset: Asset, run: Path | None = None) -> dict[str, float]:
        """What is measured of an asset; NaN, or nothing, where that is not possible."""
        return {
            **self._likeness(asset),
            "seams": seam_ratio(asset, self.width / len(self.image)),
            "repetition": self._regularity(albedo_views(asset, self._windows)[0]) - self._own_regularity,
        }

    def floor(self) -> dict[str, float]:
        """The distances of other patches of the exemplar: the least that is to be expected."""
        try:
            others = patch_features(exemplar_patches(self.image, self._patch_masks, seed=1))
            return asdict(likeness(others, self._features))
        except ImageError:
            return {}

    def pictures(self, asset: Asset, run: Path) -> dict[str, np.ndarray]:
        """As of `mitex.comparison.inputs.lit_picture`."""
        return {LIT: lit_picture(asset, self.mesh)}

    def _likeness(self, asset: Asset) -> dict[str, float]:
        """Distances of patches; none on a mesh so thin that they show too little of it."""
        try:
            ours = patch_features(albedo_views(asset, self._patches))
            return asdict(likeness(ours, self._features))
        except ImageError as e:
            log.info("%s: %s", self.mesh.name, e)
            return {}

    def _regularity(self, images: np.ndarray) -> float:
        """The mean over windows."""
        return float(np.mean([regularity(*view) for view in zip(images, self._window_masks, strict=True)]))

    @cached_property
    def _patches(self) -> Cameras:
        return patch_cameras(self.mesh, PATCHES, SHARE * self.width, round(SHARE * len(self.image)))

    @cached_property
    def _windows(self) -> Cameras:
        return patch_cameras(self.mesh, WINDOWS, self.width, len(self.image))

    @cached_property
    def _patch_masks(self) -> np.ndarray:
        return albedo_views(clay(self.mesh), self._patches)[1]

    @cached_property
    def _window_masks(self) -> np.ndarray:
        return albedo_views(clay(self.mesh), self._windows)[1]

    @cached_property
    def _features(self) -> Vectors:
        return patch_features(exemplar_patches(self.image, self._patch_masks))

    @cached_property
    def _own_regularity(self) -> float:
        return self._regularity(np.broadcast_to(self.image, (WINDOWS, *self.image.shape)))
