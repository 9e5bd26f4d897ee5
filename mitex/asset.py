"""`Asset`: a mesh and the maps it wears, per vertex and, once baked, as textures."""

from __future__ import annotations

import os
from collections.abc import Mapping
from dataclasses import dataclass, replace
from pathlib import Path
from types import MappingProxyType
from typing import Any, Literal

import numpy as np

from mitex.atlas import Atlas
from mitex.errors import ConfigError
from mitex.exemplar import MAPS
from mitex.geometry.constant import constant, sealed
from mitex.geometry.normal_maps import decode_at_vertices
from mitex.geometry.tangents import HardSplit, split_at_hard_edges
from mitex.mesh import Mesh

CLAY = 0.7  # sRGB
DEFAULT_ALBEDO = 0.8  # linear grey where an asset has no albedo
DEFAULT_ROUGHNESS = 0.5


@dataclass(frozen=True, eq=False)
class Asset:
    """A mesh with its material maps. Immutable, its arrays too; values are clipped to [0, 1] when it is made.

    Attributes:
        mesh: the mesh, V vertices and F faces.
        vertex_maps: name of `MAPS` -> (V, c) float32 in [0, 1]. Albedo is sRGB, the others are data;
            normals are (n + 1) / 2 in the frame (tangent, cross(normal, tangent), normal) of each vertex
            (OpenGL convention, +y up); at hard edges the frame turns to the normal of each side.
        tangents: (V, 3) float32, unit: where the exemplar's +u (right) points on the surface. Needed with a
            normal map.
        atlas: UV layout of `texture_maps`.
        texture_maps: name -> (N, N, c) float32 in [0, 1], row 0 on top; the normals are in the atlas' own
            frame (`geometry.tangents.split_at_seams`), which is written as glTF TANGENT.
        name: for messages and object names.

    Raises:
        ConfigError: no maps, an unknown name, a wrong shape, values that are not finite, a normal map without
            tangents, textures without an atlas.
    """

    mesh: Mesh
    vertex_maps: Mapping[str, np.ndarray]
    tangents: np.ndarray | None = None
    atlas: Atlas | None = None
    texture_maps: Mapping[str, np.ndarray] | None = None
    name: str = "asset"

    def __post_init__(self):
        if not self.vertex_maps:
            raise ConfigError("the asset has no maps", f"give at least one of {', '.join(MAPS)}")
        vertices = len(self.mesh.vertices)
        maps = {k: _checked(k, v, (vertices,), "vertex") for k, v in sorted(self.vertex_maps.items())}
        object.__setattr__(self, "vertex_maps", MappingProxyType(maps))
        if self.tangents is not None:
            object.__setattr__(self, "tangents", _checked_tangents(self.tangents, vertices))
        elif "normal" in maps:
            raise ConfigError("the asset has a normal map but no tangents", "give tangents of shape (V, 3)")
        if (self.atlas is None) != (self.texture_maps is None):
            raise ConfigError("atlas and texture_maps belong together", "give both or neither")
        if self.atlas is not None and self.texture_maps is not None:
            if self.atlas.uv.shape != (len(self.mesh.faces), 3, 2):
                raise ConfigError("the atlas belongs to another mesh", "bake the asset again")
            shape = self.atlas.face.shape
            textures = {k: _checked(k, v, shape, "texture") for k, v in sorted(self.texture_maps.items())}
            object.__setattr__(self, "texture_maps", MappingProxyType(textures))

    @property
    def maps(self) -> Mapping[str, np.ndarray]:
        """The textures if baked, else the maps at the vertices."""
        return self.vertex_maps if self.texture_maps is None else self.texture_maps

    def detail_normals(self, split: HardSplit | None = None) -> np.ndarray:
        """Normals in object space: the mesh's own, bent by the normal map if any.

        Args:
            split: the mesh split at hard edges; the smooth mesh if None.

        Returns:
            (V, 3) float32, unit; (N, 3) of the split vertices.
        """
        source = slice(None) if split is None else split.source
        normals = self.mesh.normals if split is None else split.normals
        if "normal" not in self.vertex_maps or self.tangents is None:
            return normals
        return decode_at_vertices(self.vertex_maps["normal"][source], self.tangents[source], normals)

    def baked(
        self, resolution: int = 1024, padding: int | None = None, layout: np.ndarray | None = None
    ) -> Asset:
        """The same asset with textures: every texel interpolates the vertex maps.

        Uses the given layout, or the mesh's own UVs if nothing in them overlaps, else unwraps it. Normals are
        interpolated in object space, where they are continuous but for hard edges, and written in the atlas'
        frame.

        Args:
            resolution: side of the textures [texels], 16 to 8192.
            padding: how far the charts are continued outwards [texels], so that no seam shows; 8 if None,
                less for textures under 64 texels.
            layout: (F, 3, 2) UVs in [0, 1] that do not overlap, which is not checked again.

        Raises:
            ConfigError: resolution or padding out of range.
        """
        padding = max(min(8, resolution // 8), 1) if padding is None else padding
        atlas = Atlas.build(self.mesh, resolution, padding, layout)
        faces = self.mesh.faces
        textures = {k: atlas.interpolate(v[faces]) for k, v in self.vertex_maps.items() if k != "normal"}
        if "normal" in self.vertex_maps:
            split = split_at_hard_edges(self.mesh)
            detail = atlas.interpolate(self.detail_normals(split)[split.faces])
            textures["normal"] = atlas.normal_map(self.mesh, detail)
        return replace(self, atlas=atlas, texture_maps=textures)

    def export(self, path: str | os.PathLike[str], maps_format: Literal["png", "exr"] = "png") -> Path:
        """Writes the asset; the suffix chooses the format.

        - `.glb`: glTF 2.0; with PBR textures if baked, else with vertex colours.
        - `.obj`: with `.mtl` and PNG maps beside it; bakes at the default resolution if not yet baked.
        - `.ply`: binary, vertex colours, the other maps as float properties.
        - `.exr`: the maps in texture space, named channels; bakes if not yet baked.
        - `.html`: a page that shows it in any browser with WebGL2, without a network.
        - a folder, which exists or ends with a slash: each map as a file of its own in `maps_format`, named
          as in an exemplar's folder, and mesh.obj; bakes if not yet baked.

        Returns:
            The path written.

        Raises:
            OutputError: unknown suffix or unwritable place.
        """
        from mitex.export import write_asset

        return write_asset(self, path, maps_format)

    def render(self, path: str | os.PathLike[str], **options: Any) -> Path:
        """Path-traces a still and writes it as PNG, JPEG or EXR; options as in `mitex.render.still`.

        Raises:
            OutputError: unknown suffix or unwritable place.
            ConfigError: an option out of range.
        """
        from mitex.render import render_still

        return render_still(self, path, **options)

    @staticmethod
    def load(path: str | os.PathLike[str]) -> Asset:
        """Reads an asset that `export` wrote as .glb, .obj or .ply.

        Textures are sampled at the vertices, so that `vertex_maps` is there in any case (8-bit precision).

        Raises:
            MeshError: the file is missing, damaged, or not an asset written by Mitex.
        """
        from mitex.export import read_asset

        return read_asset(path)


def clay(mesh: Mesh) -> Asset:
    """A mesh without a look of its own: in light grey."""
    return Asset(mesh, {"albedo": np.full((len(mesh.vertices), 3), CLAY, np.float32)}, name=mesh.name)


def _checked(name: str, values: np.ndarray, shape: tuple[int, ...], kind: str) -> np.ndarray:
    if name not in MAPS:
        raise ConfigError(f"{name!r} is not a map", f"use {', '.join(MAPS)}")
    values = np.asarray(values, np.float32)
    if values.shape != (*shape, MAPS[name]):
        raise ConfigError(f"{kind} map {name} has shape {values.shape}", f"it must be {(*shape, MAPS[name])}")
    if not np.isfinite(values).all():
        raise ConfigError(f"{kind} map {name} holds NaN or infinite values", "check the step that made it")
    return sealed(np.clip(values, 0.0, 1.0))


def _checked_tangents(tangents: np.ndarray, vertices: int) -> np.ndarray:
    tangents = constant(tangents, np.float32)
    if tangents.shape != (vertices, 3):
        raise ConfigError(f"tangents have shape {tangents.shape}", f"they must be {(vertices, 3)}")
    if not np.isfinite(tangents).all():
        raise ConfigError("tangents hold NaN or infinite values", "check the step that made them")
    return tangents
