"""Pictures of a textured mesh from random directions, with gradients to its texels."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch

from mitex import bridge
from mitex.geometry.tangents import split_at_seams
from mitex.mesh import Mesh
from mitex.plugins import init
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload
from mitex.scenes.cameras import Cameras, random_views
from mitex.scenes.shapes import mesh_shape


class TextureViews:
    """A mesh with a texture in a scene that is built once; cameras move, and texels change.

    Args:
        mesh: with UVs, in the space of the cameras.
        charts: (R, R) int, the chart that a texel belongs to, -1 for none: values do not cross seams.
        camera: of the size and field of view of all pictures.
        antialias: n for n x n rays per pixel.
    """

    def __init__(self, mesh: Mesh, charts: np.ndarray, camera: Cameras, antialias: int) -> None:
        init(needs="ad")
        assert mesh.uv is not None
        field = {
            "type": "texel_field",
            "data": upload(mi.TensorXf, np.zeros((*charts.shape, 4), np.float32)),
            "charts": upload(mi.TensorXf, charts.astype(np.float32)),
        }
        shape = mesh_shape(
            mesh, {"type": "diffuse", "reflectance": field}, split=split_at_seams(mesh, mesh.uv)
        )
        integrator = {"type": "feature", "name": "reflectance", "antialias": antialias}
        self.scene = mi.load_dict(
            {"type": "scene", "integrator": integrator, "mesh": shape, "sensor": camera.sensors()[0]}
        )

    def picture(self, texture: torch.Tensor, camera: Cameras) -> tuple[torch.Tensor, torch.Tensor]:
        """What a camera sees.

        Args:
            texture: (R, R, 3) float32, row 0 on top, attached or not.
            camera: one.

        Returns:
            (H, W, 3) in the units of the texture, black around the mesh, and (H, W) how much of each pixel
            shows the mesh.
        """
        params = mi.traverse(self.scene)
        params["sensor.to_world"] = mi.Transform4f(camera.sensors()[0]["to_world"].matrix)
        params.update()
        covered = torch.cat([texture, texture.new_ones(*texture.shape[:2], 1)], dim=2)
        picture = bridge.render(self.scene, covered)
        return picture[..., :3], picture[..., 3].detach()


def boxed(mesh: Mesh) -> Mesh:
    """The mesh in the middle of [-1, 1]^3, which its longest side fills."""
    low, high = mesh.vertices.min(0).astype(np.float64), mesh.vertices.max(0).astype(np.float64)
    half = max(0.5 * float((high - low).max()), 1e-30)
    return mesh.with_vertices((mesh.vertices - 0.5 * (low + high)) / half)


def random_view(
    generator: torch.Generator, nearest: float, farthest: float, fov: float, side: int
) -> Cameras:
    """A camera in a uniformly random direction, at a uniformly random distance, that looks at the origin."""
    view = random_views(generator, 1, 1.0, fov, side)
    distance = nearest + (farthest - nearest) * float(torch.rand((), generator=generator))
    return replace(view, origin=distance * view.origin)
