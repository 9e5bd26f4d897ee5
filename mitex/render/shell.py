"""Pictures of a radiance field around a mesh, in the studio where assets are pictured too."""

from __future__ import annotations

import numpy as np

from mitex.mesh import Similarity
from mitex.plugins import init
from mitex.render.framing import fit_view, hull, rotation
from mitex.render.picture import AZIMUTH, ELEVATION
from mitex.render.renderer import MAX_DEPTH, accumulated, paper_sweep, sensor
from mitex.render.studio import lights
from mitex.runtime.jit import mi
from mitex.textures.march import RadianceField


def shell_still(
    field: RadianceField,
    similarity: Similarity,
    outline: np.ndarray,
    *,
    resolution: int = 512,
    spp: int = 16,
    azimuth: float = AZIMUTH,
    elevation: float = ELEVATION,
    backdrop: bool = True,
    seed: int = 0,
) -> np.ndarray:
    """A path-traced picture of a radiance field; what is not named here is as in `still`.

    Args:
        field: in its cube.
        similarity: world -> cube.
        outline: (N, 3) points of the world that the camera is set for; the lowest is on the backdrop.

    Returns:
        (H, W, 3) float32 linear radiance.
    """
    init()
    from mitex.textures.shell_field import shell_field

    centre = outline.mean(0)
    radius = float(np.linalg.norm(outline - centre, axis=1).max())
    place = Similarity((similarity.center - centre) / radius, similarity.scale / radius)
    turn = rotation(azimuth)
    points = (outline - centre) / radius @ turn.T
    view = fit_view(hull(points), elevation)
    look_at = mi.ScalarTransform4f().look_at(view.origin.tolist(), view.target.tolist(), [0.0, 1.0, 0.0])
    scene = {
        "type": "scene",
        "integrator": {
            "type": "shell",
            "field": shell_field(field, place, turn),
            "max_depth": MAX_DEPTH,
            "hide_emitters": True,
        },
        "sensor": sensor(resolution) | {"to_world": look_at},
        **lights(),
    }
    if backdrop:
        scene["backdrop"] = paper_sweep(float(points[:, 1].min()))
    return accumulated(mi.load_dict(scene), resolution, spp, seed)
