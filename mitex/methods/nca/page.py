"""A texture on a mesh as one HTML file in which its automaton goes on (`mitex.page`)."""

from __future__ import annotations

import io
import os
from pathlib import Path
from typing import Any

import numpy as np
import torch
from PIL import Image

from mitex.cache import content_key
from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.mesh.fields import NAMES
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.decoder import Decoder, Readout
from mitex.methods.nca.decoder.surface import EDGE
from mitex.methods.nca.displacement import known_relief
from mitex.methods.nca.film import PreviewCamera, Shooting
from mitex.methods.nca.growth import grown_state
from mitex.methods.nca.look import MARGIN, Look, traits
from mitex.methods.nca.motion.condition import Field, fastest, followed_field
from mitex.methods.nca.orientation import Orientation
from mitex.methods.nca.palette import NEARLY, TOLERANCE, Palette
from mitex.methods.nca.texture import NcaTexture
from mitex.page import mesh_data, packed, quantised, write_page
from mitex.paths import prepare_output
from mitex.progress import announce

PICTURE = 384  # side of the picture for browsers without WebGL2 [px]
QUALITY = 82  # of its JPEG


def living_page(
    texture: NcaTexture,
    mesh: Mesh,
    path: str | os.PathLike[str],
    *,
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
        steps: of the picture that browsers without WebGL2 show; None as of `NcaTexture.apply`.
        seed, subdivide, scale, speed: as of `NcaTexture.apply`.
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
    shown = quantised(base)
    name = str(texture.about.get("name", "texture"))
    data = {
        "name": mesh.name,
        "seed": seed,
        "turn": np.radians(turn),
        "edge": EDGE,
        "field": followed,
        "speed": speed,
        "mesh": mesh_data(base, levels),
        "looks": [look_data(texture)],
    }
    growth = texture.growth_on(Cells.of(shown, levels), shown, turn, _source(followed), speed)
    state = grown_state(growth, seed, texture.steps if steps is None else steps)
    camera = PreviewCamera(shown, Shooting(resolution=PICTURE))
    picture = _jpeg(camera.picture(growth.shown(state)))
    return write_page(target, f"{name} on {mesh.name}", data, picture)


def look_data(texture: NcaTexture) -> dict[str, Any]:
    """A texture as JSON values: its rule, the bounds of its states, its decoder and its palette."""
    look: Look = texture.look
    rule, margin = look.rule, MARGIN * (look.high - look.low)
    record, longest = texture.about.get("palette"), fastest(texture.about)
    return {
        "name": str(texture.about.get("name", "texture")),
        "steps": texture.steps,
        "family": content_key(texture.family, repr(sorted(traits(look).items()))),
        "relief": 0.0 if "normal" in look.maps else 2 * EDGE * known_relief(texture.about, look.maps),
        "fastest": longest if np.isfinite(longest) else None,
        "channels": rule.channels,
        "hidden": rule.hidden,
        "condition": rule.condition,
        "degree": rule.degree,
        "mean": look.mean,
        "weight1": _numbers(rule.fc1.weight),
        "bias1": _numbers(rule.fc1.bias),
        "weight2": _numbers(rule.fc2.weight),
        "bias2": _numbers(rule.fc2.bias),
        "low": _numbers(look.low - margin),
        "high": _numbers(look.high + margin),
        "maps": {key: list(columns) for key, columns in look.layout.items()},
        "decoder": _decoder_data(look.decoder),
        "palette": None if record is None else _palette_data(Palette.from_record(record)),
    }


def _decoder_data(decoder: Decoder | Readout) -> dict[str, Any]:
    if isinstance(decoder, Readout):
        return {"channels": decoder.channels}
    shape, waves = decoder.shape, decoder.waves
    return {
        "interpolation": shape.interpolation,
        "coordinates": list(shape.coordinates),
        "omega": shape.omega,
        "waves": _numbers(torch.cat([waves.vectors, waves.phases[:, None]], 1)),
        "amplitude": waves.amplitude,
        "layers": [
            {
                "outputs": layer.out_features,
                "inputs": layer.in_features,
                "weight": _numbers(layer.weight),
                "bias": _numbers(layer.bias),
            }
            for layer in decoder.network.linear
        ],
    }


def _palette_data(palette: Palette) -> dict[str, Any]:
    limit = np.float32(palette.radius + TOLERANCE) * NEARLY
    return {"colours": palette.colours.tolist(), "limit": float(limit)}


def _numbers(values: torch.Tensor) -> dict[str, str]:
    return packed(values.detach().float().cpu().numpy())


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
        raise ConfigError(
            "a page knows no vector field from a file", f"use one of {', '.join(NAMES)}, or a direction"
        )
    return direction


def _source(field: str | list[float] | None) -> str | None:
    return ",".join(map(str, field)) if isinstance(field, list) else field


def _jpeg(picture: np.ndarray) -> bytes:
    """A picture (H, W, 3) in [0, 1] as JPEG."""
    buffer = io.BytesIO()
    Image.fromarray((picture * 255).round().astype(np.uint8)).save(buffer, "JPEG", quality=QUALITY)
    return buffer.getvalue()
