"""What a texture of texels looks like on its mesh, unlit: the pictures of a running synthesis."""

from __future__ import annotations

from functools import cached_property

import numpy as np

from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.methods.surface.texels import Texels
from mitex.scenes.cameras import Cameras, orbit
from mitex.scenes.stage import Hits, Stage

SAMPLES = 2  # by as many in a pixel
SHADE = 0.35  # how much darker than facing the camera a surface is that is seen edge-on


class Views:
    """Views of a mesh from opposite sides.

    Args:
        mesh: with the UVs of the texels.
        texels: of the mesh.
        side: height and width of a view [px].
        count: number of views K.
    """

    def __init__(self, mesh: Mesh, texels: Texels, side: int, count: int = 2) -> None:
        self.mesh, self.texels = mesh.normalised()[0], texels
        self.cameras: Cameras = orbit(count, distance=2.05, resolution=side)

    def images(self, values: np.ndarray) -> np.ndarray:
        """Pictures (K, H, W, C) of values (N, C), ordered as `Texels`; white around the mesh."""
        hits, index, weight, shade = self._seen
        colours = interpolate(weight, values[index]) * shade[:, None]
        samples = np.ones((len(hits.hit), values.shape[1]), np.float32)
        samples[hits.hit.numpy()] = colours
        return samples.reshape(*self.cameras.shape, SAMPLES**2, -1).mean(3)

    @cached_property
    def _seen(self) -> tuple[Hits, np.ndarray, np.ndarray, np.ndarray]:
        """Hits, the texels and weights that they read, and how bright they are."""
        hits = Stage(self.mesh).hits(self.cameras, SAMPLES)
        index, weight = self.texels.bilinear(hits.face.numpy(), hits.barycentric.numpy())
        towards = np.repeat(self._eyes, SAMPLES**2, axis=0)[hits.hit.numpy()]
        facing = np.abs(dot(self.mesh.face_normals[hits.face.numpy()], towards))
        return hits, index, weight, (1 - SHADE * (1 - facing)).astype(np.float32)

    @property
    def _eyes(self) -> np.ndarray:
        """(K H W, 3) directions of the pixels' rays."""
        return self.cameras.rays()[1].reshape(-1, 3)
