"""Pictures of a radiance field around a mesh, in the studio where assets are pictured too."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import Any

import numpy as np

from mitex.errors import ConfigError
from mitex.images import write_image
from mitex.mesh import Similarity
from mitex.paths import prepare_output
from mitex.plugins import init
from mitex.render.framing import fit_view, hull, rotation
from mitex.render.picture import AZIMUTH, ELEVATION, check_exposure, tone
from mitex.render.renderer import MAX_DEPTH, accumulated, check_elevation, paper_sweep, sensor
from mitex.render.studio import lights
from mitex.runtime.jit import mi
from mitex.suffixes import PICTURES
from mitex.textures.march import RadianceField

INTEGRATORS = {"own": "shell", "scene": "lit_shell"}  # by whose light falls on the field


def shell_still(
    field: RadianceField,
    similarity: Similarity,
    outline: np.ndarray,
    *,
    resolution: int = 512,
    spp: int = 16,
    azimuth: float = AZIMUTH,
    elevation: float = ELEVATION,
    floating: bool = False,
    light: str = "own",
    seed: int = 0,
) -> np.ndarray:
    """A path-traced picture of a radiance field; what is not named here is as in `still`.

    Args:
        field: in its cube.
        similarity: world -> cube.
        outline: (N, 3) points of the world that the camera is set for; the lowest is on the backdrop.
        resolution: side of the square picture [px], 16 to 8192.
        light: "own" is the light that the field was captured in, "scene" that of the studio, which casts
            shadows on it; the field is then a `ReflectingField`.

    Returns:
        (H, W, 3) float32 linear radiance.

    Raises:
        ConfigError: an option out of range.
    """
    if not 16 <= resolution <= 8192:
        raise ConfigError(f"a picture of {resolution} pixels is not possible", "use 16 to 8192")
    if light not in INTEGRATORS:
        raise ConfigError(f"a light called '{light}'", "use own or scene")
    check_elevation(elevation, floating)
    init(needs="ad_rgb")
    from mitex.textures.scattering import ReflectingField
    from mitex.textures.shell_field import shell_field

    if light == "scene" and not isinstance(field, ReflectingField):
        raise ConfigError(
            "this field has no reflection apart from its light",
            "give a texture of `mitex fit nerf`, or render it in its own light",
        )

    centre = outline.mean(0)
    radius = float(np.linalg.norm(outline - centre, axis=1).max())
    framed = Similarity((similarity.centre - centre) / radius, similarity.scale / radius)
    turn = rotation(math.radians(azimuth))
    points = (outline - centre) / radius @ turn.T
    view = fit_view(hull(points), math.radians(elevation))
    look_at = mi.ScalarTransform4f().look_at(view.origin.tolist(), view.target.tolist(), [0.0, 1.0, 0.0])
    scene = {
        "type": "scene",
        "integrator": {
            "type": INTEGRATORS[light],
            "field": shell_field(field, framed, turn),
            "max_depth": MAX_DEPTH,
            "hide_emitters": True,
        },
        "sensor": sensor(resolution) | {"to_world": look_at},
        **lights(),
    }
    if not floating:
        scene["backdrop"] = paper_sweep(float(points[:, 1].min()))
    return accumulated(mi.load_dict(scene), resolution, spp, seed)


def render_shell(
    field: RadianceField,
    similarity: Similarity,
    outline: np.ndarray,
    path: str | os.PathLike[str],
    *,
    exposure: float = 0.0,
    **options: Any,
) -> Path:
    """Renders `shell_still` with its `options` and writes it in sRGB after `tone`: .png or .jpg.

    Returns:
        The path written.

    Raises:
        OutputError: unknown suffix or unwritable place, before anything is rendered.
        ConfigError: an option out of range.
    """
    target = prepare_output(path, PICTURES)
    check_exposure(exposure)
    return write_image(target, tone(shell_still(field, similarity, outline, **options), exposure))
