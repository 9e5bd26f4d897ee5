"""`PreviewRenderer`: pictures in a fraction of a second, with direct light, no shadows and no noise."""

from __future__ import annotations

import math

import numpy as np

from mitex.colour import linear_to_srgb, srgb_to_linear
from mitex.mesh import Mesh
from mitex.render.framing import FOV, fit_view, hull, rotation
from mitex.render.renderer import check_elevation, check_resolution
from mitex.render.studio import GROUND, SKY

ANTIALIAS = 2  # n for n x n samples a pixel
KEY = np.array([-0.48, 0.62, 0.62])  # direction to the key light, for a camera on +z
KEY_STRENGTH, DOME_STRENGTH = 0.62, 0.55


class PreviewRenderer:
    """A mesh before a camera that stays: which points of the surface it sees is traced once.

    The light is that of the path-traced pictures, nearly: a key light from the upper left, and a dome.

    Args:
        mesh: the mesh.
        resolution: side of the square picture [px], 16 to 4096.
        azimuth, elevation: from where it is seen [degrees], as in `still`; elevations down to -85.

    Attributes:
        face: (P,) int32, the triangle under each sample that sees the mesh.
        barycentric: (P, 3) float32, where on it.
        covered: (H, W) bool, pixels that show nothing but the mesh.

    Raises:
        ConfigError: an option out of range.
    """

    def __init__(self, mesh: Mesh, *, resolution: int, azimuth: float, elevation: float) -> None:
        from mitex.scenes.cameras import Cameras
        from mitex.scenes.stage import Stage

        check_resolution(resolution)
        check_elevation(elevation, floating=True)
        normalised, _ = mesh.normalised()
        self.resolution, self._turn = resolution, rotation(math.radians(azimuth))
        view = fit_view(hull(normalised.vertices) @ self._turn.T, math.radians(elevation))
        origin, target = view.origin @ self._turn, view.target @ self._turn
        up, size = np.array([0.0, 1.0, 0.0]), {"width": resolution, "height": resolution}
        cameras = Cameras("perspective", origin, target, up, fov=math.degrees(FOV), **size)
        hits = Stage(normalised).hits(cameras, ANTIALIAS)
        self._hit = hits.hit.numpy()
        samples = self._hit.reshape(resolution, resolution, ANTIALIAS**2)
        self.covered = np.all(samples, axis=2)
        self.face, self.barycentric = hits.face.numpy(), hits.barycentric.numpy()

    def render(
        self, albedo: np.ndarray, normals: np.ndarray, occlusion: np.ndarray | float = 1.0
    ) -> np.ndarray:
        """One picture of the surface as its points are now.

        Args:
            albedo: (P, 3) sRGB in [0, 1].
            normals: (P, 3) unit, in the mesh's space.
            occlusion: (P, 1) ambient occlusion, 1 where nothing is in the way.

        Returns:
            (H, W, 3) float32 sRGB in [0, 1], before white.
        """
        facing = normals @ self._turn.T
        key = np.maximum(facing @ (KEY / np.linalg.norm(KEY)), 0.0)[:, None] * KEY_STRENGTH * math.pi / 2
        height = 0.5 + 0.5 * facing[:, 1:2]
        dome = DOME_STRENGTH * (height * np.array(SKY) + (1 - height) * np.array(GROUND))
        light = np.ones((len(self._hit), 3), np.float32)
        light[self._hit] = srgb_to_linear(albedo) * (key + dome * occlusion)
        side, n = self.resolution, ANTIALIAS
        linear = light.reshape(side, side, n * n, 3).mean(axis=2)
        return linear_to_srgb(np.clip(linear, 0.0, 1.0)).astype(np.float32)
