"""A texture on a mesh as one HTML file in which its automaton goes on (`mitex.page`)."""

from __future__ import annotations

import os
from collections.abc import Sequence
from math import radians
from pathlib import Path
from typing import Any

from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.mesh.fields import NAMES
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.surface import EDGE
from mitex.methods.nca.film import PreviewCamera, Shooting
from mitex.methods.nca.look_data import look_data
from mitex.methods.nca.motion.condition import Field, followed_field
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
        seed, subdivide, scale, speed: as of `NcaTexture.apply`.
        steps: of the picture that browsers without WebGL2 show; None as of `NcaTexture.apply`.
        orientation: an angle [degrees].
        field: name of a vector field, or a direction.

    Returns:
        The path written.

    Raises:
        OutputError: another suffix, or an unwritable place.
        ConfigError: an option out of range or, of orientation and field, one that a page cannot follow.
        MeshError: a mesh without faces, or one that cannot be remeshed.
    """
    target = prepare_output(path, (".html",))
    turn = _angle(orientation)
    followed = _field(texture, field, speed)
    announce("preparing the mesh")
    cells = Cells.of(mesh, subdivide, scale)
    base, levels = (cells.given, cells.levels) if cells.levels is not None else (cells.mesh, 0)
    content = _content([texture, *looks], [mesh_data(base, levels)], followed)
    shown = quantised(base)
    growth = texture.growth_on(Cells.of(shown, levels), shown, turn, _source(followed), speed)
    state = grown_state(growth, seed, texture.steps if steps is None else steps)
    picture = PreviewCamera(shown, Shooting(resolution=PICTURE)).picture(growth.shown(state))
    options = {"seed": seed, "turn": radians(turn), "speed": speed}
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
    return _content(textures, data, _field(textures[0], None, 1.0))


def _content(
    textures: Sequence[NcaTexture], meshes: Sequence[dict[str, Any]], field: str | list[float] | None
) -> Content:
    looks = [look_data(texture) for texture in textures]
    data = {"edge": EDGE, "seed": 0, "turn": 0.0, "speed": 1.0, "field": field}
    return Content(f"{looks[0]['name']} on {meshes[0]['name']}", data | {"meshes": meshes, "looks": looks})


def _angle(orientation: Orientation) -> float:
    if not isinstance(orientation, int | float):
        raise ConfigError("the texture of a page is turned by one angle", "give `orientation` in degrees")
    return float(orientation)


def _field(texture: NcaTexture, field: Field | None, speed: float) -> str | list[float] | None:
    """The vector field as the page names it: its name, or its direction; None for a texture that stays."""
    followed = followed_field(texture.look, texture.about, field, speed, texture.about.get("motion"))
    if followed is None or str(followed) in NAMES:
        return None if followed is None else str(followed)
    try:
        direction = [float(word) for word in str(followed).split(",")]
    except ValueError:
        direction = []
    if len(direction) != 3:
        names = ", ".join(NAMES)
        raise ConfigError("a page knows no vector field from a file", f"use one of {names}, or a direction")
    return direction


def _source(field: str | list[float] | None) -> str | None:
    return ",".join(map(str, field)) if isinstance(field, list) else field
