"""The UV layout that textures of one mesh share: a texel is as large on the surface for all methods."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from mitex.atlas import unwrap, usable_uv
from mitex.errors import ConfigError, MeshError
from mitex.geometry.triangles import twice_area
from mitex.mesh import Mesh

RESOLUTION = 512  # of the layout that sizes of patterns are relative to [texels]
EXEMPLAR_WIDTH = 0.5  # of the exemplar, unless something else is asked for [sides of the layout's square]
PADDING = 2  # texels between charts: bilinear taps of one never see the other


def exemplar_texels(size: int, resolution: int, least: int = 32) -> int:
    """Side of the exemplar on a mesh [texels].

    Args:
        size: what is asked for; 0: `EXEMPLAR_WIDTH` of the layout's square, however many texels that has.
        resolution: side of the layout's square [texels].
        least: that is enough for the network; the square's share is not taken below.

    Raises:
        ConfigError: what is asked for is not enough.
    """
    if 0 < size < least:
        raise ConfigError(f"exemplar_size = {size} is out of range", f"choose 0, or {least} or more")
    return size or max(round(EXEMPLAR_WIDTH * resolution), least)


def with_layout(mesh: Mesh, resolution: int, keep_uvs: bool = False) -> Mesh:
    """The mesh with the UVs that its texels shall have.

    Args:
        mesh: any mesh.
        resolution: side of the map that new charts are packed for [texels]; above `RESOLUTION` the layout
            stays that of `RESOLUTION`, so that more texels make nothing smaller.
        keep_uvs: use the mesh's own UVs.

    Raises:
        ConfigError: its own are wanted but missing, out of range or overlapping.
        MeshError: no face has an area (in float32), or as `unwrap`.
    """
    if not mesh.face_areas.any():
        raise MeshError(f"no face of {mesh.name} has an area", "scale it up, or check how it was exported")
    if not keep_uvs:
        return replace(mesh, uv=unwrap(mesh, min(resolution, RESOLUTION), PADDING))
    return _with_own(mesh, "to keep", "leave out `keep_uvs` to have it unwrapped")


def with_content_layout(mesh: Mesh, instead: str = "") -> Mesh:
    """The mesh, whose own UVs a content picture lies on.

    Args:
        mesh: any mesh.
        instead: what else can be done without usable UVs, for the message.

    Raises:
        ConfigError: they are missing, out of range or overlapping.
    """
    return _with_own(mesh, "for the content picture", f"give a mesh with usable UVs{instead}")


def _with_own(mesh: Mesh, purpose: str, remedy: str) -> Mesh:
    """The mesh, if its own UVs can carry a texture."""
    if mesh.uv is None:
        raise ConfigError(f"mesh '{mesh.name}' has no UVs {purpose}", remedy)
    if not usable_uv(mesh, mesh.uv):
        problem = f"the UVs of mesh '{mesh.name}' overlap, leave [0, 1] or are incomplete"
        raise ConfigError(problem, remedy)
    return mesh


def layout_side(mesh: Mesh) -> float:
    """How long the side of the layout's square is on the surface, at the median of the faces [mesh units].

    Raises:
        ConfigError: no face has an area both on the surface and in the layout.
    """
    assert mesh.uv is not None
    area, in_layout = mesh.face_areas.astype(np.float64), 0.5 * np.abs(twice_area(mesh.uv))
    solid = (area > 0) & (in_layout > 0)
    if not solid.any():
        raise ConfigError(f"mesh '{mesh.name}' has no area in its layout", "unwrap it again")
    return float(np.median(np.sqrt(area[solid] / in_layout[solid])))


def layout_ratio(mesh: Mesh, own: Mesh, resolution: int, keep_uvs: bool = False) -> float:
    """How much longer the side of a layout is on the surface than that of the layout of `RESOLUTION`.

    In smaller maps the gaps between charts take a larger part of the square.

    Args:
        mesh: before it was unwrapped.
        own, resolution, keep_uvs: of `with_layout`: its result, and what it was told.

    Raises:
        ConfigError: as `layout_side`.
    """
    if keep_uvs or resolution >= RESOLUTION:
        return 1.0
    return layout_side(own) / layout_side(with_layout(mesh, RESOLUTION))


def check_mesh(mesh: Mesh | None, own: Mesh) -> None:
    """Refuses another mesh than the one that a texture was made on; None is not checked.

    Raises:
        ConfigError: it has other vertices or faces.
    """
    if mesh is None:
        return
    if not (np.array_equal(mesh.vertices, own.vertices) and np.array_equal(mesh.faces, own.faces)):
        raise ConfigError(
            f"this texture belongs to mesh '{own.name}', not to '{mesh.name}'",
            "synthesize it there, with the config.toml of its run folder",
        )
