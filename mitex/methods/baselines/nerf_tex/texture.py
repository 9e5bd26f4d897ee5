"""`NerfTexTexture`: a box with a piece of a captured texture, to be put all over meshes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.methods.baselines.nerf_tex import METHOD
from mitex.methods.baselines.nerf_tex.anchors import place_anchors
from mitex.methods.baselines.nerf_tex.boxes import Boxes
from mitex.methods.baselines.nerf_tex.config import NerfTexConfig
from mitex.methods.baselines.nerf_tex.instances import InstancedField
from mitex.methods.baselines.nerf_tex.networks import Evaluator, network_of
from mitex.methods.baselines.nerf_tex.on_plane import BoxesOnPlane
from mitex.methods.baselines.nerf_tex.ranges import SPACINGS, TILTS
from mitex.methods.checks import in_range
from mitex.methods.nerf.field.occupancy import packed_cells, unpacked_cells
from mitex.methods.nerf.field.rendering import render_step
from mitex.methods.nerf.ranges import DENSITIES, LIFTS
from mitex.methods.nerf.use.applied_field import AppliedField
from mitex.methods.nerf.use.on_plane import SCALE, plane
from mitex.methods.nerf.use.placement import EXTENT, in_scene_cube
from mitex.ranges import SCALES, SEEDS
from mitex.runtime import init
from mitex.textures.march import DIAGONAL
from mitex.training import model_file
from mitex.training.config import of_record

SETTINGS = ("network", "table", "ray_steps", "occupancy")  # that the model depends on
FINEST = 2048  # steps across the scene cube, at most


@dataclass(frozen=True, eq=False)
class NerfTexTexture:
    """A radiance field in a box, learned by `fit`.

    Attributes:
        parameters: of the network.
        occupied: (G, G, G) uint8, cells of the box's cube [-1, 1]^3 with matter.
        about: how it was made: name, preset, steps, `SETTINGS`; `half`, half a side of the cube [scene units
            of the capture]; `ground`, how far the deepest parts are from its middle, negative [likewise];
            and `light`, where most light came from.
    """

    parameters: Mapping[str, torch.Tensor]
    occupied: np.ndarray
    about: Mapping[str, Any]

    @classmethod
    def load(cls, source: str | Path) -> NerfTexTexture:
        """Reads a run folder or a model file.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        init(needs="ad")
        with model_file.opened(source, METHOD.name) as (tensors, about):
            occupied = unpacked_cells(tensors.pop("occupied"), int(about["occupancy"]))
            shapes = network_of(cls(tensors, occupied, about).config).shapes
            numbers = np.array([about["half"], about["ground"], *about["light"]], np.float64)
            if numbers.shape != (5,) or not np.isfinite(numbers).all() or not numbers[0] > 0:
                raise ValueError("a box without a size, a ground or a light")
            return cls(model_file.of_shapes(tensors, shapes), occupied, about)

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors).

        Raises:
            OutputError: the place is not writable.
        """
        tensors = {**self.parameters, "occupied": packed_cells(self.occupied)}
        return model_file.save(path, tensors, METHOD.name, self.about)

    @property
    def config(self) -> NerfTexConfig:
        """As far as the model depends on it."""
        return of_record(NerfTexConfig, {key: self.about[key] for key in SETTINGS})

    @cached_property
    def evaluator(self) -> Evaluator:
        """The network, ready to be asked."""
        init(needs="ad")
        return network_of(self.config).evaluator(self.parameters)

    @property
    def light(self) -> np.ndarray:
        """(3,) where most light of the capture came from, of length 1."""
        return np.array(self.about["light"], np.float64)

    @property
    def bounds(self) -> tuple[np.ndarray, np.ndarray]:
        """Corners (3,) of the box in its cube: as high as its matter, as wide as the piece."""
        cells = np.argwhere(self.occupied)
        size = 2 / len(self.occupied)
        low, high = cells.min(0) * size - 1, (cells.max(0) + 1) * size - 1
        edge = np.array([EXTENT, EXTENT, 1.0])
        return np.maximum(low, -edge), np.minimum(high, edge)

    def apply(
        self,
        mesh: Mesh,
        *,
        scale: float = 1.0,
        spacing: float = 0.5,
        tilt: float = 0.0,
        aligned: bool = False,
        lift: float = 1.0,
        density: float = 1.0,
        seed: int = 0,
    ) -> AppliedField:
        """Puts boxes all over a mesh.

        Args:
            mesh: any.
            scale: size of the texture's elements beside the whole mesh, against that on the captured object.
            spacing: between anchors [sides of a box]; up to 0.5 no place is left bare.
            tilt: standard deviation by which boxes lean from the normals, in both directions [degrees].
            aligned: boxes point along the mesh's first axis as far as they can, instead of being turned about
                their normals at random, as published.
            lift: 1 puts the mesh under the texture's ground, 0 where the captured base shape was.
            density: factor of the density.
            seed: of the places and turns.

        Raises:
            MeshError: the mesh has no area.
            ConfigError: a number is out of range, the boxes are more than 50,000, or they are empty.
        """
        in_range("`seed`", seed, *SEEDS)
        in_range("`scale`", scale, *SCALES)
        in_range("`spacing`", spacing, *SPACINGS)
        in_range("`tilt`", tilt, *TILTS)
        in_range("`lift`", lift, *LIFTS)
        in_range("`density`", density, *DENSITIES)
        if not self.occupied.any():
            raise ConfigError(f"the box of '{self.about['name']}' is empty", "train it for longer")
        placed, similarity = in_scene_cube(mesh)
        half = float(self.about["half"]) * scale
        apart = spacing * 2 * EXTENT * half
        anchors = place_anchors(placed, apart, math.radians(tilt), aligned, seed)
        raised = lift * scale * max(-float(self.about["ground"]), 0.0)
        low, high = self.bounds
        boxes = Boxes(anchors, half, low, high, raised)
        step = max(half * render_step(self.config), DIAGONAL / FINEST)
        field = InstancedField(boxes, self.evaluator, self.occupied, step, self.light)
        return AppliedField(field, similarity, mesh.name, density)

    def on_plane(self, along: np.ndarray) -> BoxesOnPlane:
        """What shows boxes in the windows of photos of the capture, in its light.

        Args:
            along: (3,) direction in the scene that the planes' x follows.
        """
        return BoxesOnPlane(self.apply(plane(), scale=SCALE, lift=0.0), self.light, along)
