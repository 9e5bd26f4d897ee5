"""Images of a mesh whose vertices move, differentiable in their positions."""

from __future__ import annotations

from typing import Any

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.runtime import init, raise_causes
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.scenes.cameras import Cameras
from mitex.scenes.lights import environment
from mitex.scenes.shapes import mesh_shape

REFLECTANCE = 0.7  # of the mesh, linear


class GeometryRenderer:
    """A matte mesh in direct light; gradients reach the vertices through shading and outlines.

    Outlines are where other renderers lose derivatives: Mitsuba's projective sampling integrates along them
    (Zhang et al. 2023, "Projective Sampling for Differentiable Rendering of Geometry"). Shading is smooth:
    the steps between flat faces would be edges without a derivative.

    Args:
        mesh: whose faces stay; `render` is given the vertices.
        cameras: K views.
        samples: per pixel of the image.
        gradient_samples: per pixel of the derivative.
    """

    def __init__(
        self,
        mesh: Mesh,
        cameras: Cameras,
        *,
        samples: int = 16,
        gradient_samples: int = 16,
    ) -> None:
        init(needs="ad")
        self.samples, self.gradient_samples = samples, gradient_samples
        self.shape = mesh.vertices.shape
        matte = mi.load_dict({"type": "diffuse", "reflectance": {"type": "rgb", "value": [REFLECTANCE] * 3}})
        self.sensors = [mi.load_dict(_with_border(sensor)) for sensor in cameras.sensors()]
        # The studio's light is soft: moving edges of shadows are not worth their samples.
        scene = {"type": "scene", "integrator": {"type": "direct_projective", "sppi": 0}}
        scene |= {"shape": mesh_shape(mesh, matte, smooth=True), "studio": environment()}
        self.scene = mi.load_dict(scene)
        self._params = mi.traverse(self.scene)
        self._key = next(key for key in self._params.keys() if key.endswith("vertex_positions"))  # noqa: SIM118

    def render(self, vertices: torch.Tensor, seed: int = 0) -> torch.Tensor:
        """Images of the mesh with these vertices.

        Args:
            vertices: (V, 3) float32, attached or not.
            seed: of the samples.

        Returns:
            (K, H, W, 3) float32 linear radiance; once differentiable in the vertices.

        Raises:
            ConfigError: vertices of another shape or type.
        """
        if vertices.shape != self.shape or vertices.dtype != torch.float32:
            raise ConfigError(
                f"vertices of shape {tuple(vertices.shape)} and type {vertices.dtype}",
                f"give a float32 tensor of shape {tuple(self.shape)}",
            )
        return _Render.apply(vertices, self, seed)

    def images(self, vertices: np.ndarray, seed: int) -> np.ndarray:
        """(K, H, W, 3) float32 linear radiance of vertices (V, 3) float32, without derivatives."""
        self._move(upload(mi.Float, vertices.ravel()))
        with raise_causes():
            images = [
                mi.render(self.scene, sensor=sensor, seed=seed + k, spp=self.samples)
                for k, sensor in enumerate(self.sensors)
            ]
        return np.stack([np.asarray(image) for image in images])

    def pull_back(self, vertices: np.ndarray, gradient: np.ndarray, seed: int) -> np.ndarray:
        """(V, 3) float32 gradient with respect to the vertices, from that of the images (K, H, W, 3)."""
        integrator, total = self.scene.integrator(), np.zeros(vertices.size, np.float32)
        for k, sensor in enumerate(self.sensors):
            # One leaf for each view: a backward pass clears the graph between positions and normals.
            positions = upload(mi.Float, vertices.ravel())
            dr.enable_grad(positions)
            self._move(positions)
            adjoint = upload(mi.TensorXf, np.ascontiguousarray(gradient[k]))
            integrator.render_backward(
                self.scene, self._params, adjoint, sensor, seed + k, self.gradient_samples
            )
            total += np.asarray(dr.grad(positions))
            self._move(dr.detach(positions))
        return total.reshape(vertices.shape)

    def _move(self, positions: mi.Float) -> None:
        self._params[self._key] = positions
        self._params.update()


class _Render(torch.autograd.Function):
    """The backward pass renders anew: nothing of the forward pass is kept but the vertices."""

    @staticmethod
    def forward(ctx: Any, vertices: torch.Tensor, renderer: GeometryRenderer, seed: int) -> torch.Tensor:
        ctx.save_for_backward(vertices)
        ctx.renderer, ctx.seed = renderer, seed
        return torch.from_numpy(renderer.images(vertices.detach().numpy(), seed))

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *gradients: torch.Tensor):
        (vertices,) = ctx.saved_tensors
        # Other samples than the images': a gradient must not correlate with their noise.
        seed = ctx.seed + len(ctx.renderer.sensors)
        gradient = ctx.renderer.pull_back(vertices.detach().numpy(), gradients[0].numpy(), seed)
        return torch.from_numpy(gradient), None, None


def _with_border(sensor: dict[str, Any]) -> dict[str, Any]:
    """The sensor whose film also counts what lies just outside, which may move in."""
    return sensor | {"film": sensor["film"] | {"sample_border": True}}
