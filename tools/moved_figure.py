"""A relief that moves the surface of a training: Dr.Jit's derivatives of rays, normals and outlines."""

from __future__ import annotations

from functools import cache
from typing import Any

import numpy as np
import torch
from torch.autograd.function import once_differentiable

from mitex.bridge import call
from mitex.mesh import Mesh
from mitex.methods.nca.look import Look
from mitex.methods.nca.surfaces import TrainingMesh
from mitex.methods.nca.text.views import Figure, Views
from mitex.plugins import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.scenes.cameras import Cameras
from mitex.scenes.shaded import AMBIENT, BACKGROUND, BRIGHTEST, GREY, lamps
from mitex.scenes.shapes import mesh_shape
from mitex.textures.triangle import triangle_points

OUTLINE_SAMPLES = 1  # of a pixel: the gradient has a cosine of 0.998 with that of 16


class MovedFigure(Figure):
    """The pictures of a `Figure`, of a surface that its relief moves; colours are those of the vertices.

    All views are one wavefront, whose rays meet the moved surface with derivatives. Outlines, which whole
    views have and close-ups do not, are Mitsuba's projective sampling, view by view.

    Args:
        surface, bound: as of a `Figure`, on the processor.
    """

    def __init__(self, surface: TrainingMesh, bound: float) -> None:
        super().__init__(surface, bound)
        init(needs="ad")
        self._still = torch.tensor(surface.mesh.vertices)
        # The graph between positions and normals is a scene's own, until other positions come.
        self._inside, self.border = MovedScene(surface.mesh), MovedScene(surface.mesh)

    def textured(self, look: Look, state: torch.Tensor, cameras: Cameras) -> Views:
        """With what a state (V, C) shows; differentiable in the state and the look's decoder."""
        values = look.decoder(self.surface.surface, self.surface.surface.table(state), self.relief.corners)
        height = values[:, look.layout["height"][0]]
        colours = values[:, list(look.layout["albedo"])].clamp(0, 1)
        coloured, plain = self.pictures(self.moved(height), colours, cameras)
        return Views(coloured, plain, values, height)

    def moved(self, height: torch.Tensor) -> torch.Tensor:
        """Where heights (V,) put the vertices (V, 3)."""
        return self._still + self.relief.offsets(height)[:, None] * self.relief.plain

    def pictures(
        self, vertices: torch.Tensor, colours: torch.Tensor, cameras: Cameras
    ) -> tuple[torch.Tensor, torch.Tensor]:
        """Pictures (K, H, W, 3) of vertices (V, 3) with sRGB colours (V, 3), and in grey."""
        traced = call(lambda v, c: self._traced(v, c, cameras), vertices, colours)
        coloured, plain = traced.view(*cameras.shape, 4).split([3, 1], 3)
        plain = plain.expand(-1, -1, -1, 3)
        if cameras.kind == "perspective":
            even = torch.full_like(colours, GREY)
            coloured = _Outlined.apply(coloured, vertices, self, colours.detach(), cameras)
            plain = _Outlined.apply(plain, vertices, self, even, cameras)
        return coloured, plain

    def _traced(self, vertices: mi.TensorXf, colours: mi.TensorXf, cameras: Cameras) -> mi.TensorXf:
        """What each pixel sees, (P, 4): the colours, and grey."""
        self._inside.move(vertices.array)
        origins, directions = (upload(mi.Float, part.ravel()) for part in cameras.rays())
        pixel = dr.arange(mi.UInt32, int(np.prod(cameras.shape)))
        ray = mi.Ray3f(dr.gather(mi.Point3f, origins, pixel), dr.gather(mi.Vector3f, directions, pixel))
        towards = upload(mi.Float, lamps(cameras).numpy().ravel())
        lamp = dr.gather(mi.Vector3f, towards, pixel // (cameras.width * cameras.height))
        si = self._inside.scene.ray_intersect(ray, mi.RayFlags.All, True)
        colour, shade = seen(si, colours.array, lamp)
        grey = dr.select(si.is_valid(), GREY * shade, BACKGROUND)
        return mi.TensorXf(dr.ravel(mi.Vector4f(*colour, grey)), (len(pixel), 4))


class MovedScene:
    """A mesh whose vertices move, in a Mitsuba scene; shading is smooth."""

    def __init__(self, mesh: Mesh) -> None:
        self.scene = mi.load_dict({"type": "scene", "shape": mesh_shape(mesh, smooth=True)})
        self.params = mi.traverse(self.scene)
        self._key = next(key for key in self.params.keys() if key.endswith("vertex_positions"))  # noqa: SIM118

    def move(self, positions: mi.Float) -> None:
        """Puts the scene's vertices where these 3 V numbers say."""
        self.params[self._key] = positions
        self.params.update()


def seen(si: mi.SurfaceInteraction3f, colours: mi.Float, lamp: mi.Vector3f) -> tuple[mi.Color3f, mi.Float]:
    """The colour at points of a mesh by those of its vertices (3 V numbers), shaded as by
    `mitex.scenes.shaded`, and its shade.
    """
    count = dr.opaque(mi.UInt32, dr.width(colours) // 3)
    corners, weights, active = triangle_points(si, count, si.is_valid())
    colour = mi.Color3f(0)
    for corner, weight in zip(corners, weights, strict=True):
        colour += weight * dr.gather(mi.Color3f, colours, corner, active)
    x = dr.dot(mi.Vector3f(si.sh_frame.n), lamp)
    shade = AMBIENT + (1 - AMBIENT) / BRIGHTEST * (0.25 + 0.5 * x + 5 / 32 * (3 * x * x - 1))
    return dr.select(active, shade * colour, mi.Color3f(BACKGROUND)), shade


class _Outlined(torch.autograd.Function):
    """Pictures as they are, whose gradients also reach the vertices through the outlines."""

    @staticmethod
    def forward(
        ctx: Any,
        pictures: torch.Tensor,
        vertices: torch.Tensor,
        figure: MovedFigure,
        colours: torch.Tensor,
        cameras: Cameras,
    ) -> torch.Tensor:
        ctx.save_for_backward(vertices, colours)
        ctx.figure, ctx.cameras = figure, cameras
        return pictures.clone()

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, *gradients: torch.Tensor):
        vertices, colours = (upload(mi.Float, t.detach().numpy().ravel()) for t in ctx.saved_tensors)
        total = np.zeros(dr.width(vertices), np.float32)
        border, integrator = ctx.figure.border, outlines()(mi.Properties())
        integrator.colours = colours
        for k, sensor in enumerate(ctx.cameras.sensors()):
            integrator.lamp = mi.Vector3f(*lamps(ctx.cameras)[k].tolist())
            # One leaf for each view: a backward pass clears the graph between positions and normals.
            positions = mi.Float(vertices)
            dr.enable_grad(positions)
            border.move(positions)
            adjoint = upload(mi.TensorXf, np.ascontiguousarray(gradients[0][k].numpy()))
            camera = mi.load_dict(sensor | {"film": sensor["film"] | {"sample_border": True}})
            integrator.render_backward(border.scene, border.params, adjoint, camera, k, OUTLINE_SAMPLES)
            total += np.asarray(dr.grad(positions))
            border.move(dr.detach(positions))
        return gradients[0], torch.from_numpy(total).view(-1, 3), None, None, None


@cache
def outlines() -> type:
    """The class of the integrator of outlines, of the current variant."""
    base: Any = type(mi.load_dict({"type": "direct_projective"}))

    class Outlines(base):
        """Derivatives of outlines alone, of the colours that `seen` tells."""

        colours: mi.Float
        lamp: mi.Vector3f

        def __init__(self, props: mi.Properties) -> None:
            super().__init__(props)
            self.sppc = self.sppi = 0

        def sample(
            self, mode, scene, sampler, ray, depth, δL, state_in, active, project=False, si_shade=None, **_
        ):
            si = scene.ray_intersect(ray, active) if si_shade is None else si_shade
            return seen(si, self.colours, self.lamp)[0], active & si.is_valid(), [], None

    return Outlines
