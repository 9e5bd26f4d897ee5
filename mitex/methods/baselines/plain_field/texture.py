"""`PlainFieldTexture`: density and colours of the object in photos, which cannot leave it."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.mesh import Mesh, Similarity
from mitex.methods.baselines.plain_field import METHOD
from mitex.methods.baselines.plain_field.config import PlainFieldConfig
from mitex.methods.checks import in_range
from mitex.methods.nerf.field.grid_networks import GridNetworks
from mitex.methods.nerf.field.occupancy import packed_cells, unpacked_cells
from mitex.methods.nerf.field.rendering import render_step
from mitex.methods.nerf.ranges import DENSITIES
from mitex.methods.nerf.training.plain import PlainField, grid_layout
from mitex.methods.nerf.use.applied_field import AppliedField
from mitex.runtime import init
from mitex.runtime.jit import mi
from mitex.runtime.upload import upload
from mitex.training import model_file
from mitex.training.config import of_record

SETTINGS = ("table", "ray_steps", "occupancy")  # that the model depends on


@dataclass(frozen=True, eq=False)
class PlainFieldTexture:
    """A plain radiance field, learned by `fit`.

    Attributes:
        parameters: table and matrices, in the order of `GridLayout.shapes`.
        occupied: (G, G, G) uint8, cells of the scene cube with matter.
        about: how it was made: name, preset, steps, `SETTINGS`, and how the capture was placed.
    """

    parameters: Mapping[str, torch.Tensor]
    occupied: np.ndarray
    about: Mapping[str, Any]

    @classmethod
    def load(cls, source: str | Path) -> PlainFieldTexture:
        """Reads a run folder or a model file.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        init(needs="ad")
        with model_file.opened(source, METHOD.name) as (tensors, about):
            occupied = unpacked_cells(tensors.pop("occupied"), int(about["occupancy"]))
            texture = cls(tensors, occupied, about)
            texture.similarity  # noqa: B018  (raises where its numbers are none)
            shapes = grid_layout(texture.config).shapes
            return cls(model_file.of_shapes(tensors, shapes), occupied, about)

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors).

        Raises:
            OutputError: the place is not writable.
        """
        tensors = {**self.parameters, "occupied": packed_cells(self.occupied)}
        return model_file.save(path, tensors, METHOD.name, self.about)

    @property
    def config(self) -> PlainFieldConfig:
        """As far as the model depends on it."""
        return of_record(PlainFieldConfig, {key: self.about[key] for key in SETTINGS})

    @cached_property
    def field(self) -> PlainField:
        """The field in the scene cube, ready to be marched."""
        init(needs="ad")
        mask = upload(mi.TensorXu8, self.occupied)
        networks = GridNetworks.packed(grid_layout(self.config), self.parameters)
        return PlainField(networks, mask, render_step(self.config))

    def in_place(self) -> PlainField:
        """What shows the object in the photos' cameras: `field`."""
        return self.field

    @property
    def similarity(self) -> Similarity:
        """The capture's world -> scene cube."""
        return Similarity.of_record(self.about)

    def apply(self, mesh: Mesh | None = None, *, density: float = 1.0) -> AppliedField:
        """The object itself, in the capture's world.

        Args:
            mesh: None; there is no other object that a plain field can be put on.
            density: factor of the density; more makes thin parts solid.

        Raises:
            ConfigError: a mesh was given, or the density is out of range.
        """
        if mesh is not None:
            raise ConfigError(
                f"a plain field cannot be put on '{mesh.name}'",
                "leave out the mesh, or learn a texture with mitex fit nerf",
            )
        in_range("`density`", density, *DENSITIES)
        return AppliedField(self.field, self.similarity, str(self.about["name"]), density)
