"""Training the textured shell: latent features on the base shape, and the networks (section 3.3)."""

from __future__ import annotations

import math
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from mitex.bridge import call
from mitex.cache import content_key
from mitex.integrators.march import Samples, accumulated, weights_of
from mitex.mesh import Mesh
from mitex.methods.nerf.capture import Capture
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field import Decoder, Encoding
from mitex.methods.nerf.light_estimate import estimated_light
from mitex.methods.nerf.losses import clustering, normal_agreement
from mitex.methods.nerf.mlp import weight_bound
from mitex.methods.nerf.networks import ELEVATION, weight_shapes
from mitex.methods.nerf.occupancy import Occupancy, hull_cells
from mitex.methods.nerf.pixels import Batch
from mitex.methods.nerf.projection import Feet, Projection, attach
from mitex.methods.nerf.radiance import RadianceTask, Rendered, look_step, rays_of
from mitex.methods.nerf.shell import CapturedLatents, Located, Shell, appearance, shell_cells, within
from mitex.methods.nerf.tensors import rows, tensor
from mitex.runtime import bfloat16_is_fast, load_mitsuba

mi: Any = load_mitsuba(needs_llvm=False)
import drjit as dr  # noqa: E402  (Mitsuba first: it decides which LLVM Dr.Jit opens)

CLUSTERS = 4  # centres in each level
OUTWARDS = 0.1  # share of the coarse normal in what the fine one is compared with
SURFACE = 0.5  # share of its ray from which on a sample is what one sees
HIDDEN_RAYS = 0.25  # share of the rays below whose surface the inside is looked at
BURIED = 0.25  # of the shell's thickness on one side: what has so much matter around it, no photo sees
AROUND = (0, 0, 0), (0, 0, 1), (1, 0, 0), (-1, 0, 0), (0, 1, 0), (0, -1, 0)  # where that is looked for
LEAST = 1e-3  # opacity of rays whose normals are compared
# Fine normals start near those of the faces: under random ones k_d learns the shades first.
FLAT = 1e-2
POSE = 1e-2  # unit of the cameras' corrections [rad, scene units]


class TextureTask(RadianceTask):
    """Features, networks, light and cluster centres, trained on a capture around a base shape.

    Args:
        config: settings.
        capture, shown: as of `RadianceTask`.
        projection: onto the base shape.
        frames: (F, 3, 3) of its faces.
        thickness: h, half of the shell's [scene units].
    """

    def __init__(
        self,
        config: NerfConfig,
        capture: Capture,
        shown: tuple[Capture, int],
        projection: Projection,
        frames: np.ndarray,
        thickness: float,
    ) -> None:
        self.projection, self.frames, self.thickness = projection, frames, thickness
        self.encoding = Encoding(config)
        parameters = _start(config, self.encoding, capture, projection.mesh)
        possible = shell_cells(projection, thickness, hull_cells(capture, config.occupancy))
        super().__init__(config, capture, shown, Occupancy(config.occupancy, possible), parameters)

    def metadata(self) -> dict[str, str]:
        mesh = self.projection.mesh
        base = content_key(mesh.vertices, mesh.faces, self.thickness)
        return {"method": "nerf", "capture": self.pixels.capture.name, "base": base}

    def aimed(self, batch: Batch) -> Batch:
        if not self.config.refine_cameras:
            return batch
        turn, shift = (POSE * self.named["poses"].detach()[batch.view]).split(3, dim=1)
        directions = _turned(torch.from_numpy(batch.directions), turn).numpy()
        return replace(batch, origins=batch.origins + shift.numpy(), directions=directions)

    def render(self, step: int, batch: Batch, samples: Samples, generator: torch.Generator) -> Rendered:
        origin, direction = rays_of(batch)
        index, feet = within(self.projection(rows(samples.points(origin, direction))), self.thickness)
        samples = samples.kept(mi.UInt32(index.astype(np.uint32)))
        foot, distance, along = self._attached(batch, samples, feet)
        compared = int(self.config.normal_rays * samples.rays) if self.config.normals else 0
        hidden = int(HIDDEN_RAYS * samples.rays) if self._knows_inside(step) else 0
        depths = torch.rand(hidden, generator=generator).numpy()

        def run(foot: Any, distance: Any, along: Any, light: Any, *arrays: Any) -> Any:
            located = Located.of(feet)
            located.foot, located.distance = dr.unravel(mi.Point3f, foot.array), distance.array
            latents, decoder = self._model(arrays)
            view = dr.unravel(mi.Vector3f, along.array)
            detach = self.config.detach_normals
            density, colour, normal = appearance(latents, decoder, light, located, view, detach)
            shares, through = weights_of(density, samples)
            rgb = accumulated(colour * shares, samples)
            fine, wanted = self._normals(arrays, located, normal, shares, samples, compared)
            strange = self._inside(arrays, located, shares, samples, mi.Float(depths))
            results = rgb, through, shares, fine, wanted, strange
            return tuple(tensor(result) for result in results)

        networks = [v for name, v in self.named.items() if name.startswith(("tables/", "weights/"))]
        results = call(run, foot, distance, along, self.named["light"], *networks)
        colour, through, weights, fine, wanted, strange = results
        made = Rendered(colour, through, weights, samples)
        seen = wanted.norm(dim=1) > LEAST
        if seen.any():
            made.terms["normals"] = self.config.normals * normal_agreement(fine[seen], wanted[seen])
        if len(strange):
            made.terms["inside"] = self.config.inside * strange.mean()
        if self.config.clustering:
            made.terms["clusters"] = self.config.clustering * self._clusters(generator)
        return made

    def field(self, parameters: dict[str, torch.Tensor]) -> Shell:
        model = self.model(parameters, packed=True)
        mask, step = self.occupancy.mask, look_step(self.config)
        return Shell(self.projection, *model, self.thickness, mask=mask, step=step)

    def density(self, points: np.ndarray) -> np.ndarray:
        return self.field(self.named).density(points)

    def model(
        self, parameters: dict[str, torch.Tensor], packed: bool
    ) -> tuple[CapturedLatents, Decoder, Any]:
        """Latents, networks and light with given parameters, constant."""
        arrays = [mi.TensorXf(v.detach().numpy()) for k, v in parameters.items() if "/" in k and k[0] in "tw"]
        latents, decoder = self._model(arrays, packed)
        return latents, decoder, mi.TensorXf(parameters["light"].detach().numpy())

    def _model(self, arrays: Any, packed: bool = False) -> tuple[CapturedLatents, Decoder]:
        tables, weights = [a.array for a in arrays[:2]], arrays[2:]
        decoder = Decoder(weights, packed, low_precision=bfloat16_is_fast())
        return CapturedLatents(self.encoding, tables, self.frames), decoder

    def _attached(
        self, batch: Batch, samples: Samples, feet: Feet
    ) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
        """Foot points, distances and directions of samples, attached to the cameras if these are refined."""
        ray = torch.from_numpy(np.array(samples.ray).astype(np.int64))
        directions = torch.from_numpy(batch.directions)
        if not self.config.refine_cameras:
            return torch.from_numpy(feet.point), torch.from_numpy(feet.distance), directions[ray]
        correction = POSE * self.named["poses"][batch.view]
        turn, shift = (correction - correction.detach()).split(3, dim=1)  # `aimed` has its value
        directions = _turned(directions, turn)
        t = torch.from_numpy(np.array(samples.t))
        points = (torch.from_numpy(batch.origins) + shift)[ray] + directions[ray] * t[:, None]
        return *attach(points, feet), directions[ray]

    def _normals(
        self, arrays: Any, located: Located, normal: Any, shares: Any, samples: Samples, rays: int
    ) -> tuple[Any, Any]:
        """Fine normals and those that the density's slope asks for, gathered along the first `rays` rays."""
        compared = samples.ray < rays
        chosen: Any = dr.compress(compared)
        share = dr.detach(shares)
        fine = accumulated(normal * dr.select(compared, share, 0), samples)
        if not dr.width(chosen):
            return fine, dr.zeros(mi.Vector3f, samples.rays)
        part = located.part(chosen)
        slope = self._slope([dr.detach(a) for a in arrays], part)
        target = dr.normalize((1 - OUTWARDS) * slope + OUTWARDS * part.normal)
        share = dr.gather(mi.Float, share, chosen)
        return fine, accumulated(target * share, samples.kept(chosen))

    def _inside(self, arrays: Any, located: Located, shares: Any, samples: Samples, depths: Any) -> Any:
        """How strange the looks of what is buried are, below the ends of the first rays: L1 of them.

        `depths` says for each of these rays which share of the way down to the shell's bottom that is. Places
        near a surface are no part of it: photos may see them from elsewhere.
        """
        chosen: Any = dr.compress((samples.ray < dr.width(depths)) & (dr.detach(shares) > SURFACE))
        if not dr.width(chosen):
            return mi.Float()
        latents, decoder = self._model([*map(dr.detach, arrays[:2]), *arrays[2:]])
        part = located.part(chosen)
        features = latents(part)
        depth = dr.gather(mi.Float, depths, dr.gather(mi.UInt32, samples.ray, chosen))
        with dr.suspend_grad():
            above = decoder(*features, part.distance)
            part.distance -= depth * (part.distance + self.thickness)
            buried = self._buried(latents, decoder, part)
        below = decoder(*features, part.distance)
        return buried * sum(dr.abs(a - b) for a, b in zip(below.looks, above.looks, strict=True))

    def _buried(self, latents: CapturedLatents, decoder: Decoder, located: Located) -> Any:
        """The least opacity of a step at places, a bit above them, and a bit to four sides of them."""
        across, along = mi.coordinate_system(located.normal)
        reach = BURIED * self.thickness
        lowest = mi.Float(math.inf)
        for x, y, z in AROUND:
            foot = located.foot + reach * (x * across + y * along)
            moved = replace(located, foot=foot, distance=located.distance + reach * z)
            lowest = dr.minimum(lowest, decoder.exponent(latents.features(moved), moved.distance))
        return 1 - dr.exp(-dr.exp(lowest) * self.step_length)

    def _knows_inside(self, step: int) -> bool:
        """Only late: colours learn slower beside a loss that wants them the same at all depths.

        `steps` has no say, or a run that goes on for more steps would not be that of one go.
        """
        return self.config.inside > 0 and 2 * step >= self.config.lr_steps

    def _slope(self, arrays: Any, located: Located) -> Any:
        """The direction in which the density falls, by equation 2 from its slopes in foot and distance."""
        latents, decoder = self._model(arrays)
        located = Located(**vars(located))
        foot, distance = mi.Point3f(located.foot), mi.Float(located.distance)
        with dr.resume_grad():
            dr.enable_grad(foot, distance)
            located.foot, located.distance = foot, distance
            dr.backward(decoder.exponent(latents.features(located), distance))
        along, n = dr.grad(foot), located.normal
        slope = along - n * dr.dot(along, n) + n * dr.grad(distance)
        return dr.normalize(-slope)

    def _clusters(self, generator: torch.Generator) -> torch.Tensor:
        """The clustering loss of one level of f, drawn by chance."""
        levels = self.encoding.levels(0)
        level = int(torch.randint(len(levels), (), generator=generator))
        entries = self.named["tables/f"][levels[level]].view(-1, 2)
        if 0 < self.config.cluster_entries < len(entries):
            entries = entries[
                torch.randint(len(entries), (self.config.cluster_entries,), generator=generator)
            ]
        return clustering(entries, self.named["centres"][level])


def _turned(directions: torch.Tensor, turn: torch.Tensor) -> torch.Tensor:
    """Unit vectors (N, 3), turned by small rotation vectors (N, 3) [rad]."""
    directions = directions + torch.linalg.cross(turn, directions)
    return directions / directions.norm(dim=1, keepdim=True)


def _start(config: NerfConfig, encoding: Encoding, capture: Capture, base: Mesh) -> dict[str, torch.Tensor]:
    """Parameters to start from, by name."""
    drawn = torch.Generator().manual_seed(config.seed)

    def uniform(shape: int | tuple[int, ...], low: float, high: float) -> torch.Tensor:
        return torch.empty(shape).uniform_(low, high, generator=drawn)

    f, phase = encoding.sizes
    parameters = {"tables/f": uniform(f, -1e-4, 1e-4), "tables/phase": uniform(phase, 0.0, 1e-3)}
    for k, shape in enumerate(weight_shapes(config)):
        bound = weight_bound(shape) * (FLAT if k == ELEVATION else 1)
        parameters[f"weights/{k}"] = uniform(shape, -bound, bound)
    parameters["light"] = torch.from_numpy(estimated_light(base, capture))
    parameters["centres"] = uniform((len(encoding.levels(0)), CLUSTERS, 2), -1e-4, 1e-4)
    if config.refine_cameras:
        parameters["poses"] = torch.zeros(len(capture), 6)
    for name, value in parameters.items():
        value.requires_grad_(config.learn_light or name != "light")
    return parameters
