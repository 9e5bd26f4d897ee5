"""Training the textured shell: latent features on the base shape, and the networks (section 3.3)."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import torch

from mitex.bridge import call
from mitex.cache import content_key
from mitex.colour import linear_to_srgb, srgb_to_linear
from mitex.mesh import Mesh
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.capture.pixels import Batch
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field.decoder import Decoder
from mitex.methods.nerf.field.encoding import Encoding
from mitex.methods.nerf.field.mlp import weight_bound
from mitex.methods.nerf.field.networks import ELEVATION, weight_shapes
from mitex.methods.nerf.field.occupancy import Occupancy, hull_cells
from mitex.methods.nerf.field.projection import Projection, Projections, attach
from mitex.methods.nerf.field.rendering import batch_rays, render_step
from mitex.methods.nerf.field.shell import (
    CapturedLatents,
    Shell,
    ShellCoords,
    appearance,
    shell_cells,
    within,
)
from mitex.methods.nerf.field.tensors import rows, tensor
from mitex.methods.nerf.training.light_estimate import estimated_light
from mitex.methods.nerf.training.losses import clustering, normal_agreement
from mitex.methods.nerf.training.radiance import RadianceTask, Rendered
from mitex.runtime import bfloat16_is_fast
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.textures.march import Samples, sum_rays, weights_of

CLUSTERS = 4  # centres in each level
OUTWARDS = 0.1  # share of the coarse normal in what the fine one is compared with
SURFACE = 0.5  # compositing weight from which on a sample is the visible surface
INTERIOR_RAYS = 0.25  # share of the rays below whose surface the interior is evaluated
BURIED = 0.25  # of the shell's thickness on one side: what has so much matter around it, no photo sees
AROUND = (0, 0, 0), (0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)  # where matter is looked for
LEAST = 1e-3  # opacity of rays whose normals are compared, and whose colours are exposed
# Fine normals start near those of the faces: under random ones k_d learns the shades first.
FLAT = 1e-2
POSE = 1e-2  # unit of the cameras' corrections [rad, scene units]


class TextureTask(RadianceTask[NerfConfig]):
    """Features, networks, light and cluster centres, trained on a capture around a base shape.

    Args:
        config: settings.
        capture, preview_view: as of `RadianceTask`.
        projection: onto the base shape.
        frames: (F, 3, 3) of its faces.
        thickness: h, half of the shell's [scene units].
    """

    def __init__(
        self,
        config: NerfConfig,
        capture: Capture,
        preview_view: tuple[Capture, int],
        projection: Projection,
        frames: np.ndarray,
        thickness: float,
    ) -> None:
        self.projection, self.frames, self.thickness = projection, frames, thickness
        self.encoding = Encoding(config)
        parameters = _initial_parameters(config, self.encoding, capture, projection.mesh)
        possible = shell_cells(projection, thickness, hull_cells(capture, config.occupancy))
        super().__init__(config, capture, preview_view, Occupancy(config.occupancy, possible), parameters)

    def metadata(self) -> dict[str, str]:
        mesh = self.projection.mesh
        base = content_key(mesh.vertices, mesh.faces, self.thickness)
        return {"method": "nerf", "base_key": base} | self.pixels.capture.metadata()

    def with_cameras(self, batch: Batch) -> Batch:
        if not self.config.refine_cameras:
            return batch
        turn, shift = (POSE * self.named["poses"].detach()[batch.view]).split(3, dim=1)
        directions = _rotate(torch.from_numpy(batch.directions), turn).numpy()
        return replace(batch, origins=batch.origins + shift.numpy(), directions=directions)

    def render(self, step: int, batch: Batch, samples: Samples, generator: torch.Generator) -> Rendered:
        origin, direction = batch_rays(batch)
        index, projections = within(self.projection(rows(samples.points(origin, direction))), self.thickness)
        samples = samples.subset(upload(mi.UInt32, index.astype(np.uint32)))
        foot, distance, along = self._attached(batch, samples, projections)
        compared_rays = int(self.config.normal_rays * samples.rays) if self.config.normals else 0
        interior_rays = int(INTERIOR_RAYS * samples.rays) if self._uses_interior(step) else 0
        depths = torch.rand(interior_rays, generator=generator).numpy()

        def run(
            foot: mi.TensorXf,
            distance: mi.TensorXf,
            along: mi.TensorXf,
            light: mi.TensorXf,
            *arrays: mi.TensorXf,
        ) -> tuple[mi.TensorXf, ...]:
            coords = ShellCoords.of(projections)
            coords.foot, coords.distance = dr.unravel(mi.Point3f, foot.array), distance.array
            latents, decoder = self._model(arrays)
            view = dr.unravel(mi.Vector3f, along.array)
            detach = self.config.detach_normals
            density, colour, normal = appearance(latents, decoder, light, coords, view, detach)
            weights, transmittance = weights_of(density, samples)
            rgb = sum_rays(colour * weights, samples)
            fine, target = self._normals(arrays, coords, normal, weights, samples, compared_rays)
            interior = self._interior(arrays, coords, weights, samples, upload(mi.Float, depths))
            results = rgb, transmittance, weights, fine, target, interior
            return tuple(tensor(result) for result in results)

        networks = [v for name, v in self.named.items() if name.startswith(("tables/", "weights/"))]
        results = call(run, foot, distance, along, self.named["light"], *networks)
        colour, transmittance, weights, fine, target, interior = results
        colour = self._exposed(colour, 1 - transmittance, batch.view)
        rendered = Rendered(colour, transmittance, weights, samples)
        valid = target.norm(dim=1) > LEAST
        if valid.any():
            rendered.terms["normals"] = self.config.normals * normal_agreement(fine[valid], target[valid])
        if len(interior):
            rendered.terms["interior"] = self.config.interior_weight * interior.mean()
        if self.config.clustering:
            rendered.terms["clusters"] = self.config.clustering * self._clusters(generator)
        return rendered

    def field(self, parameters: dict[str, torch.Tensor]) -> Shell:
        model = self.model(parameters, packed=True)
        mask, step = self.occupancy.mask, render_step(self.config)
        return Shell(self.projection, *model, self.thickness, mask=mask, step=step)

    def density(self, points: np.ndarray) -> np.ndarray:
        return self.field(self.named).density(points)

    def model(
        self, parameters: dict[str, torch.Tensor], packed: bool
    ) -> tuple[CapturedLatents, Decoder, mi.TensorXf]:
        """Latents, networks and light with given parameters, constant."""
        arrays = [
            upload(mi.TensorXf, v.detach().numpy())
            for k, v in parameters.items()
            if "/" in k and k[0] in "tw"
        ]
        latents, decoder = self._model(arrays, packed)
        return latents, decoder, upload(mi.TensorXf, parameters["light"].detach().numpy())

    def _model(self, arrays: Sequence[mi.TensorXf], packed: bool = False) -> tuple[CapturedLatents, Decoder]:
        tables, weights = [a.array for a in arrays[:2]], arrays[2:]
        decoder = Decoder(weights, packed, low_precision=bfloat16_is_fast())
        return CapturedLatents(self.encoding, tables, self.frames), decoder

    def _attached(
        self, batch: Batch, samples: Samples, projections: Projections
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Foot points, distances and directions of samples, attached to the cameras if these are refined."""
        ray = torch.from_numpy(np.array(samples.ray).astype(np.int64))
        directions = torch.from_numpy(batch.directions)
        if not self.config.refine_cameras:
            return (
                torch.from_numpy(projections.point),
                torch.from_numpy(projections.distance),
                directions[ray],
            )
        correction = POSE * self.named["poses"][batch.view]
        turn, shift = (correction - correction.detach()).split(3, dim=1)  # `with_cameras` has its value
        directions = _rotate(directions, turn)
        t = torch.from_numpy(np.array(samples.t))
        points = (torch.from_numpy(batch.origins) + shift)[ray] + directions[ray] * t[:, None]
        return *attach(points, projections), directions[ray]

    def _exposed(self, colour: torch.Tensor, opacity: torch.Tensor, view: np.ndarray) -> torch.Tensor:
        """Colours (R, 3), in display values times opacity (R,), as photos `view` (R,) were exposed.

        Gains are factors of linear light. Their geometric mean is 1, or the light could be any.
        """
        if not self.config.exposures:
            return colour
        logarithms = self.named["exposures"]
        gain = (logarithms - logarithms.mean()).exp()[view, None]
        straight = colour / opacity[:, None].clamp(min=LEAST)
        return opacity[:, None] * linear_to_srgb(gain * srgb_to_linear(straight))

    def _normals(
        self,
        arrays: Sequence[mi.TensorXf],
        coords: ShellCoords,
        normal: mi.Vector3f,
        weights: mi.Float,
        samples: Samples,
        rays: int,
    ) -> tuple[mi.Vector3f, mi.Vector3f]:
        """Fine normals and the density's directions of descent, gathered along the first `rays` rays."""
        compared = samples.ray < rays
        index = mi.UInt32(dr.compress(compared))
        weights = dr.detach(weights)
        fine = sum_rays(normal * dr.select(compared, weights, 0), samples)
        if not dr.width(index):
            return fine, dr.zeros(mi.Vector3f, samples.rays)
        part = coords.subset(index)
        slope = self._slope([dr.detach(a) for a in arrays], part)
        target = dr.normalize((1 - OUTWARDS) * slope + OUTWARDS * part.normal)
        weights = dr.gather(mi.Float, weights, index)
        return fine, sum_rays(target * weights, samples.subset(index))

    def _interior(
        self,
        arrays: Sequence[mi.TensorXf],
        coords: ShellCoords,
        weights: mi.Float,
        samples: Samples,
        depths: mi.Float,
    ) -> mi.Float:
        """L1 between the reflectances of buried points below the ends of rays, and of the surface above.

        `depths` are, for each of these rays, shares of the way down to the shell's bottom. Places
        near a surface are no part of it: photos may see them from elsewhere.
        """
        index = mi.UInt32(dr.compress((samples.ray < dr.width(depths)) & (dr.detach(weights) > SURFACE)))
        if not dr.width(index):
            return mi.Float()
        latents, decoder = self._model([*map(dr.detach, arrays[:2]), *arrays[2:]])
        part = coords.subset(index)
        features = latents(part)
        depth = dr.gather(mi.Float, depths, dr.gather(mi.UInt32, samples.ray, index))
        thickness = dr.opaque(mi.Float, self.thickness)  # as a literal it would ask for a kernel of its own
        with dr.suspend_grad():
            above = decoder(*features, part.distance)
            part.distance -= depth * (part.distance + thickness)
            buried = self._buried(latents, decoder, part)
        below = decoder(*features, part.distance)
        return buried * sum(
            dr.abs(a - b) for a, b in zip(below.reflectances, above.reflectances, strict=True)
        )

    def _buried(self, latents: CapturedLatents, decoder: Decoder, coords: ShellCoords) -> mi.Float:
        """The least opacity of a step at places, a bit above them, and a bit to four sides of them."""
        across, along = mi.coordinate_system(coords.normal)
        reach, step = (dr.opaque(mi.Float, v) for v in (BURIED * self.thickness, self.step_length))
        lowest = mi.Float(math.inf)
        for x, y, z in AROUND:
            foot = coords.foot + mi.Point3f(reach * (x * across + y * along))
            moved = replace(coords, foot=foot, distance=coords.distance + reach * z)
            lowest = dr.minimum(lowest, decoder.exponent(latents.features(moved), moved.distance))
        return 1 - dr.exp(-dr.exp(lowest) * step)

    def _uses_interior(self, step: int) -> bool:
        """Only late: colours learn slower beside a loss that wants them the same at all depths."""
        return self.config.interior_weight > 0 and self.is_late(step)

    def _slope(self, arrays: Sequence[mi.TensorXf], coords: ShellCoords) -> mi.Vector3f:
        """The direction in which the density falls, by equation 2 from its slopes in foot and distance."""
        latents, decoder = self._model(arrays)
        coords = ShellCoords(**vars(coords))
        foot, distance = mi.Point3f(coords.foot), mi.Float(coords.distance)
        with dr.resume_grad():
            dr.enable_grad(foot, distance)
            coords.foot, coords.distance = foot, distance
            dr.backward(decoder.exponent(latents.features(coords), distance))
        along, n = mi.Vector3f(dr.grad(foot)), coords.normal
        slope = along - n * dr.dot(along, n) + n * dr.grad(distance)
        return dr.normalize(-slope)

    def _clusters(self, generator: torch.Generator) -> torch.Tensor:
        """The clustering loss (equation 3) of one level of f, drawn at random."""
        levels = self.encoding.levels(0)
        level = int(torch.randint(len(levels), (), generator=generator))
        entries = self.named["tables/f"][levels[level]].view(-1, 2)
        if 0 < self.config.cluster_entries < len(entries):
            entries = entries[
                torch.randint(len(entries), (self.config.cluster_entries,), generator=generator)
            ]
        return clustering(entries, self.named["centres"][level])


def _rotate(directions: torch.Tensor, turn: torch.Tensor) -> torch.Tensor:
    """Unit vectors (N, 3), turned by rotation vectors (N, 3) [rad] that are small."""
    directions = directions + torch.linalg.cross(turn, directions)
    return directions / directions.norm(dim=1, keepdim=True)


def _initial_parameters(
    config: NerfConfig, encoding: Encoding, capture: Capture, base: Mesh
) -> dict[str, torch.Tensor]:
    """Parameters to start from, by name."""
    generator = torch.Generator().manual_seed(config.seed)

    def uniform(shape: int | tuple[int, ...], low: float, high: float) -> torch.Tensor:
        return torch.empty(shape).uniform_(low, high, generator=generator)

    f, phase = encoding.sizes
    parameters = {"tables/f": uniform(f, -1e-4, 1e-4), "tables/phase": uniform(phase, 0.0, 1e-3)}
    for k, shape in enumerate(weight_shapes(config)):
        bound = weight_bound(shape) * (FLAT if k == ELEVATION else 1)
        parameters[f"weights/{k}"] = uniform(shape, -bound, bound)
    parameters["light"] = torch.from_numpy(estimated_light(base, capture, config.exposures))
    parameters["centres"] = uniform((len(encoding.levels(0)), CLUSTERS, 2), -1e-4, 1e-4)
    if config.refine_cameras:
        parameters["poses"] = torch.zeros(len(capture), 6)
    if config.exposures:
        parameters["exposures"] = torch.zeros(len(capture))  # logarithms
    for name, value in parameters.items():
        value.requires_grad_(config.learn_light or name != "light")
    return parameters
