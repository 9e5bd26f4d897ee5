"""Unlit views of a texture on its mesh: the previews of a running synthesis."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import dot
from mitex.methods.surface.domain import SurfaceDomain
from mitex.scenes.cameras import Cameras, orbit
from mitex.scenes.stage import Hits, Stage

SAMPLES = 2  # rows and columns of samples in a pixel
SHADE = 0.35  # how much darker a surface is that is seen edge-on than one that faces the camera


class Views:
    """Views of a mesh from opposite sides.

    Args:
        domain: the mesh and its texels.
        side: height and width of a view [px].
        count: number of views K.
    """

    def __init__(self, domain: SurfaceDomain, side: int, count: int = 2) -> None:
        self.mesh, self.domain = domain.mesh.normalised()[0], domain
        self.cameras: Cameras = orbit(count, distance=2.05, resolution=side)

    def images(self, values: np.ndarray) -> np.ndarray:
        """Images (K, H, W, C) of values (N, C), ordered as `Texels`; white around the mesh."""
        hits, index, weight, shade = self._samples
        colours = interpolate(weight, values[index]) * shade[:, None]
        samples = np.ones((len(hits.hit), values.shape[1]), np.float32)
        samples[hits.hit.numpy()] = colours
        return samples.reshape(*self.cameras.shape, SAMPLES**2, -1).mean(3)

    @cached_property
    def _samples(self) -> tuple[Hits, np.ndarray, np.ndarray, np.ndarray]:
        """Hits, the texels and weights that they read, and how bright they are."""
        hits = Stage(self.mesh).hits(self.cameras, SAMPLES)
        index, weight = self.domain.texels.bilinear(hits.face.numpy(), hits.barycentric.numpy())
        towards = np.repeat(self._directions, SAMPLES**2, axis=0)[hits.hit.numpy()]
        facing = np.abs(dot(self.mesh.face_normals[hits.face.numpy()], towards))
        return hits, index, weight, (1 - SHADE * (1 - facing)).astype(np.float32)

    @property
    def _directions(self) -> np.ndarray:
        """(K H W, 3) directions of the pixels' rays."""
        return self.cameras.rays()[1].reshape(-1, 3)
