"""How near the form of a relief comes to that of a reference, wherever things are and however large."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from mitex.errors import ImageError
from mitex.evaluation.likeness import Vectors, patch_features
from mitex.evaluation.metrics import frechet_distance
from mitex.evaluation.relief_patches import relief_cameras, relief_views
from mitex.mesh import Mesh

PATCHES, PIXELS = 8, 96
WIDTH = 0.3  # of a patch [largest extents of the mesh]
SIZES = (0.25, 0.35, 0.5, 0.71, 1.0, 1.41)  # of the relief that are tried
LAYERS = ("relu2_2", "relu3_1", "relu4_1")
PLANE = {"normals": (0.5, 0.5, 1.0), "curvature": (0.5, 0.5, 0.5)}  # pictures of a plane


@dataclass(frozen=True)
class Form:
    """How a relief looks beside the reference.

    Attributes:
        distance: 0 for the reference itself; 1 is the distance of a plane.
        coarse: the same by the last of the layers alone: shapes as a whole and how they are arranged.
        size: of the relief beside the mesh, in relation to the size that it has beside the reference.
    """

    distance: float
    coarse: float
    size: float


class ReliefForm:
    """A reference, to compare reliefs with.

    Features of VGG-16 of patches of normals and of curvature are taken as Gaussians. Each Frechet distance is
    divided by that of a plane; the distance is the mean of the roots over both kinds of pictures and three
    layers, whose features see about 14, 24 and 60 pixels of 96.

    Args:
        reference: whose form is wanted.
    """

    def __init__(self, reference: Mesh) -> None:
        self.reference = reference
        self._features = _features(reference, 1.0, seed=0)
        self._plane = _plane_features()
        self._unit = self._distances(self._plane)

    def of(self, mesh: Mesh) -> Form:
        """A relief at the size of `SIZES` at which it is most alike.

        Raises:
            ImageError: it is so thin that patches of no size show enough of it.
        """
        forms = []
        for size in SIZES:
            try:
                forms.append(self.at(mesh, size))
            except ImageError:
                continue
        if not forms:
            raise ImageError(f"patches of {mesh.name} show too little of it", "compare a less thin mesh")
        return min(forms, key=lambda form: form.distance)

    def at(self, mesh: Mesh, size: float = 1.0, seed: int = 0) -> Form:
        """A relief at a known size; `seed` is that of the places.

        Raises:
            ImageError: patches show too little of the mesh.
        """
        distances = np.sqrt(self._distances(_features(mesh, size, seed)) / self._unit)
        return Form(float(distances.mean()), float(distances[:, -1].mean()), size)

    def _distances(self, features: dict[str, Vectors]) -> np.ndarray:
        """Frechet distances of each kind of pictures and layer (2, L)."""
        return np.array(
            [
                [
                    frechet_distance(features[kind][layer].double(), self._features[kind][layer].double())
                    for layer in LAYERS
                ]
                for kind in PLANE
            ]
        )


def _features(mesh: Mesh, size: float, seed: int) -> dict[str, Vectors]:
    extent = float((mesh.vertices.max(0) - mesh.vertices.min(0)).max())
    cameras = relief_cameras(mesh, PATCHES, WIDTH * size * extent, PIXELS, seed)
    return {kind: patch_features(views, LAYERS) for kind, views in relief_views(mesh, cameras).items()}


def _plane_features() -> dict[str, Vectors]:
    mask = np.ones((1, PIXELS, PIXELS), bool)
    pictures = {kind: np.full((*mask.shape, 3), colour, np.float32) for kind, colour in PLANE.items()}
    return {kind: patch_features((picture, mask), LAYERS) for kind, picture in pictures.items()}
