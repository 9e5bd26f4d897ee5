"""A grown state whose height is a relief: as normals, and as a displacement of the mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import replace
from functools import cached_property
from typing import Any

import numpy as np
import torch

from mitex.asset import Asset
from mitex.atlas import Atlas
from mitex.geometry.normal_maps import encode
from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import orthonormal, unit
from mitex.mesh import Mesh
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.decoder.surface import vertex_points
from mitex.methods.nca.displacement import Displacement


class EmbossedTexture(GrownTexture):
    """As `GrownTexture`, with a normal map that follows from the height.

    Args:
        relief: of the automaton's mesh.
        moved: whether the vertices are moved too; the normal map then tells what they do not.
        grown: arguments of `GrownTexture`, or of the class that is derived from both, in their order.
    """

    def __init__(self, relief: Displacement, moved: bool, *grown: Any) -> None:
        super().__init__(*grown)
        self.relief, self.moved = relief, moved

    def asset(self) -> Asset:
        plain, mesh = super().asset(), self._mesh
        assert plain.tangents is not None
        tangents = orthonormal(plain.tangents, mesh.normals)
        normals = self._normals(plain.mesh.normals, *self._vertices())
        encoded = encode(normals, tangents, np.cross(mesh.normals, tangents), mesh.normals)
        maps = {**plain.vertex_maps, "normal": encoded}
        return replace(plain, mesh=mesh, vertex_maps=maps, tangents=tangents)

    def textures(self, atlas: Atlas) -> dict[str, np.ndarray]:
        detail = np.zeros((*atlas.face.shape, 3), np.float32)
        for rows in atlas.strips():
            used, face, barycentric = atlas.points(rows)
            normals = unit(interpolate(barycentric, self.cells.base.shading_normals[face]))
            detail[rows][used] = self._normals(normals, face, barycentric)
        return super().textures(atlas) | {"normal": atlas.normal_map(self._mesh, detail)}

    def detail_normals(
        self, maps: Mapping[str, np.ndarray], normals: np.ndarray, face: np.ndarray, barycentric: np.ndarray
    ) -> np.ndarray:
        return self._normals(normals, face, barycentric)

    @cached_property
    @torch.no_grad()
    def _height(self) -> torch.Tensor:
        """(V,) at the vertices of the automaton's mesh."""
        values = self._decoded(vertex_points(self.cells.mesh))
        return torch.from_numpy(values[:, self.look.layout["height"][0]])

    @cached_property
    def _mesh(self) -> Mesh:
        """The base mesh, moved if it shall be."""
        mesh = self.cells.base
        if not self.moved:
            return mesh
        offsets = self._at(self.relief.offsets(self._height)[:, None].numpy(), *self._vertices())
        return mesh.with_vertices(mesh.vertices + offsets * mesh.normals)

    def _normals(self, normals: np.ndarray, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """Normals of the relief (P, 3) at points of the base mesh, given its own there."""
        slopes = self._at(self.relief.slopes(self._height).numpy(), face, barycentric)
        return unit(normals - slopes).astype(np.float32)

    def _at(self, values: np.ndarray, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """Values (V, C) of the automaton's vertices at points of the base mesh, (P, C)."""
        located, weights = self.cells.locate(face, barycentric)
        return interpolate(weights, values[self.cells.mesh.faces[located]])
