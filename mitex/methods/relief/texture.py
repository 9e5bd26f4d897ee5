"""`ReliefTexture`: a mesh that was moved, and the maps that it wears."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.asset import Asset, clay
from mitex.exemplar import MAPS
from mitex.export.common import asset_from_textures
from mitex.mesh import Mesh
from mitex.mesh.arrays import mesh_arrays, mesh_of_arrays
from mitex.mesh.untangling import untangled
from mitex.methods.layout import check_mesh
from mitex.methods.relief import METHOD
from mitex.training import model_file

PLAIN, MOVED, MAP = "plain_", "moved_", "map_"  # prefixes of the arrays in a model file


@dataclass(frozen=True, eq=False)
class ReliefTexture:
    """A relief and the mesh that it belongs to.

    Attributes:
        mesh: as it was given, with the UVs of the maps.
        plain: the same surface with the faces of the relief.
        moved: the relief.
        textures: maps that it wears, name -> (R, R, c) float32 in [0, 1]; albedo is sRGB.
        about: how it was made.
    """

    mesh: Mesh
    plain: Mesh
    moved: Mesh
    textures: Mapping[str, np.ndarray]
    about: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, source: str | Path) -> ReliefTexture:
        """Reads a run folder or a model file.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        with model_file.opened(source, METHOD.name) as (tensors, about):
            arrays = {key: tensor.numpy() for key, tensor in tensors.items()}
            mesh, plain = (mesh_of_arrays(_under(arrays, p), str(about["mesh"])) for p in ("", PLAIN))
            if mesh.uv is None or plain.uv is None:
                raise ValueError("a mesh without UVs")
            maps = {name: image.astype(np.float32) for name, image in _under(arrays, MAP).items()}
            for name, image in maps.items():
                if image.shape != (len(image), len(image), MAPS[name]) or not np.isfinite(image).all():
                    raise ValueError(f"a map {name} of shape {image.shape}")
            return cls(mesh, plain, plain.with_vertices(arrays[MOVED + "vertices"]), maps, about)

    def save(self, path: str | Path) -> Path:
        """Writes meshes, maps and `about` as one safetensors file.

        Raises:
            OutputError: the place is not writable.
        """
        arrays = mesh_arrays(self.mesh) | {PLAIN + key: a for key, a in mesh_arrays(self.plain).items()}
        arrays[MOVED + "vertices"] = self.moved.vertices
        arrays |= {MAP + name: image.astype(np.float16) for name, image in self.textures.items()}
        tensors = {name: torch.tensor(array) for name, array in arrays.items()}
        return model_file.save(path, tensors, METHOD.name, {**self.about, "mesh": self.mesh.name})

    def apply(self, mesh: Mesh | None = None, untangle: bool = False) -> Asset:
        """The moved mesh with its maps, without colours a grey one.

        Args:
            mesh: the mesh that the relief was made for, if the caller wants that checked.
            untangle: draw the relief back where the surface pierces itself; see `untangled`.

        Raises:
            ConfigError: it is another mesh: a relief belongs to the mesh that it was made on.
        """
        check_mesh(mesh, self.mesh)
        moved = untangled(self.plain, self.moved) if untangle else self.moved
        if not self.textures:
            return clay(moved)
        assert moved.uv is not None
        return asset_from_textures(moved, moved.uv, self.textures, self.mesh.name)


def _under(arrays: Mapping[str, np.ndarray], prefix: str) -> dict[str, np.ndarray]:
    """The arrays with this prefix, which is taken off."""
    return {key.removeprefix(prefix): array for key, array in arrays.items() if key.startswith(prefix)}
