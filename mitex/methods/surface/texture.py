"""A texture synthesized on one mesh: how it is kept, and the asset that it makes."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.asset import Asset
from mitex.atlas import PADDING, Atlas, spread
from mitex.geometry.normal_maps import decode
from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import rotate_about, unit_normals
from mitex.mesh import Mesh
from mitex.mesh.arrays import mesh_arrays, mesh_of_arrays
from mitex.methods.layout import check_mesh
from mitex.methods.surface import METHOD
from mitex.methods.surface.config import SurfaceConfig
from mitex.methods.surface.domain import SurfaceDomain
from mitex.training import model_file
from mitex.training.config import of_record
from mitex.triples import map_layout


@dataclass(frozen=True, eq=False)
class SurfaceTexture:
    """A texture and the mesh that it was synthesized on.

    Attributes:
        domain: the mesh with the UVs of the texture, and its texels.
        values: (N, C) float32 in [0, 1], the channels of one map after another, in the order of the texels.
        maps: their names, in that order.
        about: how it was made; the domain's `resolution`, `frames` and `angle` [degrees] at least.
    """

    domain: SurfaceDomain
    values: np.ndarray
    maps: tuple[str, ...]
    about: Mapping[str, Any] = field(default_factory=dict)

    @property
    def mesh(self) -> Mesh:
        """The mesh that the texture belongs to."""
        return self.domain.mesh

    def apply(self, mesh: Mesh | None = None) -> Asset:
        """The asset: the mesh with baked maps.

        Args:
            mesh: the mesh that the texture was made for, if the caller wants that checked.

        Raises:
            ConfigError: it is another mesh: a surface texture belongs to the mesh it was synthesized on.
        """
        check_mesh(mesh, self.mesh)
        texels, layout = self.domain.texels, map_layout(self.maps)
        atlas = Atlas.from_uv(self.domain.uv, texels.resolution)
        used = texels.image(np.ones((len(self.values), 1), np.float32))[..., 0] > 0
        textures = {}
        for name, channels in layout.items():
            textures[name] = spread(texels.image(self.values[:, channels]), used, PADDING)
        if "normal" in layout:
            textures["normal"] = self._normals(atlas, layout["normal"], used)
        at_vertices = self._at_vertices()
        angle = math.radians(self.domain.angle)
        tangents = rotate_about(self.domain.directions, self.mesh.normals, angle)
        maps = {name: at_vertices[:, channels] for name, channels in layout.items()}
        return Asset(self.mesh, maps, tangents, atlas, textures, self.mesh.name)

    def save(self, path: str | Path) -> Path:
        """Writes mesh, texels and `about` as one safetensors file."""
        arrays = mesh_arrays(self.mesh)
        if self.domain.orientation is not None:
            arrays["orientation"] = self.domain.orientation
        tensors = {name: torch.tensor(a) for name, a in arrays.items()}
        tensors["values"] = torch.from_numpy(np.ascontiguousarray(self.values, np.float16))
        about = {**self.about, "maps": list(self.maps), "mesh": self.mesh.name}
        return model_file.save(path, tensors, METHOD.name, about)

    @classmethod
    def load(cls, source: str | Path) -> SurfaceTexture:
        """Reads a texture file, or that of a run folder.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        with model_file.opened(source, METHOD.name) as (tensors, about):
            arrays = {key: tensor.numpy() for key, tensor in tensors.items()}
            mesh = mesh_of_arrays(arrays, str(about["mesh"]))
            if mesh.uv is None:
                raise ValueError("a mesh without UVs")
            kept = {key: about[key] for key in ("resolution", "frames", "angle")}
            # The exemplar is not kept: any size of it will do.
            config = of_record(SurfaceConfig, kept | {"exemplar_size": 256})
            orientation = arrays.get("orientation")
            domain = SurfaceDomain(mesh, config.resolution, config.frames, config.angle, orientation)
            values, maps = arrays["values"].astype(np.float32), tuple(about["maps"])
            channels = sum(map(len, map_layout(maps).values()))
            if values.shape != (len(domain.texels.index), channels):
                raise ValueError("texels or channels are missing")
            return cls(domain, values, maps, about)

    def _at_vertices(self) -> np.ndarray:
        """(V, C) values at the vertices, from the first face around each; 0 without a face."""
        corners = self.mesh.faces.ravel()
        vertices, first = np.unique(corners, return_index=True)
        index, weight = self.domain.texels.bilinear(first // 3, np.eye(3)[first % 3])
        values = np.zeros((len(self.mesh.vertices), self.values.shape[1]), np.float32)
        values[vertices] = interpolate(weight, self.values[index])
        return values

    def _normals(self, atlas: Atlas, channels: tuple[int, ...], used: np.ndarray) -> np.ndarray:
        """The normal map, from the texels' frames into those of the atlas."""
        texels, (right, up) = self.domain.texels, self.domain.tangent_frames
        # Bumps are added to the surface that viewers shade, smooth but for hard edges, not to its flat faces.
        smooth = interpolate(texels.barycentric, self.mesh.shading_normals[texels.face])
        flat = unit_normals(self.mesh.face_crosses[texels.face])
        detail = decode(self.values[:, channels], right, up, flat) - flat + smooth
        return atlas.normal_map(self.mesh, spread(texels.image(detail), used, PADDING))
