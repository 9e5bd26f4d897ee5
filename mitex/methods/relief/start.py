"""What a relief begins with: a mesh with fine faces, and the heights and colours of its vertices."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from mitex.export.relief import BUMPS, at_vertices, split_faces, vertex_heights
from mitex.geometry.vectors import rotate_about
from mitex.mesh import Mesh
from mitex.mesh.frames import vertex_directions
from mitex.methods.layout import layout_side
from mitex.methods.relief.config import ReliefConfig
from mitex.methods.surface import SurfaceTexture

ROUGHNESS = 0.02  # standard deviation of heights to begin with, where there are no others [depths]


@dataclass(frozen=True, eq=False)
class Start:
    """The beginning of a fit.

    Attributes:
        mesh: as it was given, with the UVs of the maps.
        directions: (V, 3) where the exemplar's right points at its vertices.
        fine: the same surface with W vertices.
        heights: (W,) from -1 to 1, in depths of the relief, 0 in the mean.
        colours: (W, 3) sRGB in [0, 1]; None without.
        textures: maps that the relief is worn with, name -> (R, R, c).
        layout_ratio: of the mesh's layout, as `mitex.methods.layout.layout_ratio` tells.
    """

    mesh: Mesh
    directions: np.ndarray
    fine: Mesh
    heights: np.ndarray
    colours: np.ndarray | None
    textures: Mapping[str, np.ndarray]
    layout_ratio: float = 1.0

    @staticmethod
    def of_maps(texture: SurfaceTexture, config: ReliefConfig) -> Start:
        """With the heights and colours of a surface texture."""
        asset = texture.apply()
        fine, heights = vertex_heights(asset, config.faces)
        assert asset.texture_maps is not None
        textures = {name: values for name, values in asset.texture_maps.items() if name not in BUMPS}
        angle = math.radians(texture.domain.angle)
        directions = rotate_about(texture.domain.directions, texture.mesh.normals, angle)
        colours = at_vertices(textures["albedo"], fine) if "albedo" in textures else None
        return Start(texture.mesh, directions, fine, heights, colours, textures)

    @staticmethod
    def flat(mesh: Mesh, config: ReliefConfig) -> Start:
        """Without maps: of a mesh with a layout, a little rough, since nothing pulls at a smooth surface."""
        fine = split_faces(mesh, config.resolution, config.faces)
        random = np.random.default_rng(config.seed)
        heights = ROUGHNESS * random.standard_normal(len(fine.vertices))
        return Start(mesh, vertex_directions(mesh), fine, heights, None, {})

    def exemplar_width(self, config: ReliefConfig) -> float:
        """How wide the exemplar is on the mesh [mesh units]."""
        side = layout_side(self.mesh) / self.layout_ratio
        return side * config.exemplar_side / config.resolution
