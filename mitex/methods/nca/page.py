"""A texture on a mesh as one HTML file in which its automaton goes on (`mitex.page`)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from math import radians
from pathlib import Path
from typing import Any

from mitex.mesh import Mesh
from mitex.mesh.fields import NAMES
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.surface import EDGE
from mitex.methods.nca.film import FilmSettings, PreviewCamera
from mitex.methods.nca.look_data import look_data
from mitex.methods.nca.motion.cell_motion import motion_field
from mitex.methods.nca.motion.condition import Field, cell_vectors
from mitex.methods.nca.orientation import Orientation
from mitex.methods.nca.texture import NcaTexture, grown_state
from mitex.page import Content, jpeg, mesh_data, quantised
from mitex.paths import prepare_output
from mitex.progress import announce

PICTURE = 384  # side of the picture for browsers without WebGL2 [px]


def living_page(
    texture: NcaTexture,
    mesh: Mesh,
    path: str | os.PathLike[str],
    *,
    looks: Sequence[NcaTexture] = (),
    seed: int = 0,
    steps: int | None = None,
    subdivide: int | str = "auto",
    orientation: Orientation = 0.0,
    scale: float = 1.0,
    field: Field | None = None,
    speed: float = 1.0,
) -> Path:
    """Writes a page in which the texture grows, heals and turns on the mesh, in any browser with WebGL2.

    Args:
        texture: what grows.
        mesh: any mesh.
        path: target, .html.
        looks: further textures that the page offers; those of one family can be grafted onto each other.
        seed, subdivide, orientation, scale, field, speed: as of `NcaTexture.apply`.
        steps: of the picture that browsers without WebGL2 show; None as of `NcaTexture.apply`.

    Returns:
        The path written.

    Raises:
        OutputError: another suffix, or an unwritable place.
        ConfigError: an option out of range, or a field as of `NcaTexture.apply`.
        MeshError: a mesh without faces, or one that cannot be remeshed.
    """
    target = prepare_output(path, (".html",))
    moved = _followed(texture, field, speed)
    announce("preparing the mesh")
    cells = Cells.of(mesh, subdivide, scale)
    base, levels = (cells.base, cells.levels) if cells.levels is not None else (cells.mesh, 0)
    turn, upwards = (orientation, None) if isinstance(orientation, int | float) else (0.0, orientation)
    own = {
        name: cell_vectors(mesh, base, source, 1.0)
        for name, source in {"motion": moved, "upwards": upwards}.items()
        if source is not None and _anywhere(source) is None
    }
    everywhere = _anywhere(moved) or _anywhere(texture.about.get("motion"))
    content = _content([texture, *looks], [mesh_data(base, levels, own)], everywhere)
    shown = quantised(base)
    followed = own.get("upwards", orientation), own.get("motion", field)
    growth = texture.growth_on(Cells.of(shown, levels), shown, *followed, speed)
    state = grown_state(growth, seed, texture.steps if steps is None else steps)
    picture = PreviewCamera(shown, FilmSettings(resolution=PICTURE)).picture(growth.texture(state))
    options = {"seed": seed, "turn": radians(turn), "upwards": _anywhere(upwards), "speed": speed}
    return Content(content.title, {**content.data, **options}, jpeg(picture)).write(target)


def contents(sources: Sequence[str | Path], meshes: Sequence[Mesh]) -> Content:
    """What a page shows that offers some models, files or run folders, on some meshes.

    Raises:
        CheckpointError: one of them does not exist, or is damaged.
        MeshError: a mesh without faces.
    """
    textures = [NcaTexture.load(source) for source in sources]
    levels = [Cells.of(mesh).levels or 0 for mesh in meshes]
    data = [mesh_data(mesh, level) for mesh, level in zip(meshes, levels, strict=True)]
    return _content(textures, data, _anywhere(_followed(textures[0], None, 1.0)))


def _content(
    textures: Sequence[NcaTexture], meshes: Sequence[dict[str, Any]], field: str | list[float] | None
) -> Content:
    looks = [look_data(texture) for texture in textures]
    data = {"edge": EDGE, "seed": 0, "turn": 0.0, "upwards": None, "speed": 1.0, "field": field}
    return Content(f"{looks[0]['name']} on {meshes[0]['name']}", data | {"meshes": meshes, "looks": looks})


def _followed(texture: NcaTexture, field: Field | None, speed: float) -> Field | None:
    """The vector field that a texture follows in a page."""
    return motion_field(texture.look, texture.about, field, speed, texture.about.get("motion"))


def _anywhere(field: Field | None) -> str | list[float] | None:
    """A vector field that every mesh has, by its name or as its direction; None for others."""
    if not isinstance(field, str) or field in NAMES:
        return field if isinstance(field, str) else None
    try:
        direction = [float(word) for word in field.split(",")]
    except ValueError:
        return None
    return direction if len(direction) == 3 else None
