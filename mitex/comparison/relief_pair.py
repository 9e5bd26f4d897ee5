"""A surface with relief, and a mesh: how near the details of displaced meshes come to it."""

from __future__ import annotations

import logging
from functools import cached_property
from pathlib import Path

import numpy as np

from mitex.asset import CLAY, Asset, clay
from mitex.cache import content_key
from mitex.comparison.inputs import lit_picture, mesh_of, read_once
from mitex.comparison.results import LIT
from mitex.errors import ImageError
from mitex.evaluation.form import ReliefForm
from mitex.evaluation.metrics import single_image_frechet
from mitex.evaluation.surface_statistics import statistic_distances
from mitex.mesh import Mesh
from mitex.mesh.self_intersections import piercing_pairs
from mitex.methods.geometric.references import find_reference
from mitex.render.preview import PreviewRenderer

log = logging.getLogger(__name__)

VIEWS, SIDE = 4, 192  # pictures from around, and their side [px]
ELEVATION = 15.0  # of the camera [degrees]


@read_once
def reference_of(name: str) -> Mesh:
    """A reference by its path or name.

    Raises:
        MeshError: It cannot be read.
    """
    return find_reference(name)


class ReliefPair:
    """A reference and a mesh.

    Args:
        exemplar: path or name of the reference.
        mesh: path or name.
    """

    judge = None

    def __init__(self, exemplar: str, mesh: str) -> None:
        self.reference, self.mesh = reference_of(exemplar), mesh_of(mesh)

    @property
    def key(self) -> str:
        """A hash of both."""
        return content_key(
            *(array for mesh in (self.reference, self.mesh) for array in (mesh.vertices, mesh.faces))
        )

    @property
    def image(self) -> np.ndarray:
        """The reference in light."""
        return lit_picture(clay(self.reference))

    def numbers(self, asset: Asset, run: Path | None = None) -> dict[str, float]:
        """Distances of form, of the statistics of edges and vertices, and of shaded pictures."""
        pairs = zip(views(asset.mesh), self._views, strict=True)
        shading = [
            single_image_frechet(ours, theirs, mask_a=mask, mask_b=other)
            for (ours, mask), (theirs, other) in pairs
        ]
        return {
            **self._form_of(asset.mesh),
            "piercing": len(piercing_pairs(asset.mesh)),
            **statistic_distances(asset.mesh, self.reference),
            "shading": float(np.mean(shading)),
        }

    def floor(self) -> dict[str, float]:
        """The form of other patches of the reference; all else is 0, since it is compared as a whole."""
        try:
            form = self._form.at(self.reference, seed=1)
        except ImageError:
            return {}
        return {"form": form.distance, "form_coarse": form.coarse}

    def pictures(self, asset: Asset, run: Path) -> dict[str, np.ndarray]:
        """As of `mitex.comparison.inputs.lit_picture`."""
        return {LIT: lit_picture(asset, self.mesh)}

    def _form_of(self, mesh: Mesh) -> dict[str, float]:
        """Distances and size; nothing for meshes so thin that patches show too little of them."""
        try:
            form = self._form.of(mesh)
        except ImageError as e:
            log.info("%s: %s", mesh.name, e)
            return {}
        return {"form": form.distance, "form_coarse": form.coarse, "relief_size": form.size}

    @cached_property
    def _form(self) -> ReliefForm:
        return ReliefForm(self.reference)

    @cached_property
    def _views(self) -> list[tuple[np.ndarray, np.ndarray]]:
        return views(self.reference)


def views(mesh: Mesh) -> list[tuple[np.ndarray, np.ndarray]]:
    """Pictures (SIDE, SIDE, 3) of a mesh in grey from around, and (SIDE, SIDE) bool what shows it."""
    result = []
    for k in range(VIEWS):
        renderer = PreviewRenderer(mesh, resolution=SIDE, azimuth=360.0 * k / VIEWS, elevation=ELEVATION)
        grey = np.full((len(renderer.face), 3), CLAY, np.float32)
        result.append((renderer.render(grey, mesh.face_normals[renderer.face]), renderer.covered))
    return result
