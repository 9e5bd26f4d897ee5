"""A small captured texture, and settings of a small fit to one of its boxes."""

from __future__ import annotations

from dataclasses import replace

from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.base.base_shape import face_frames
from tests.methods.nerf.small import small_texture

SMALL = ["patch=64", "views=16", "view=16", "rays=256", "ray_steps=64", "table=10", "occupancy=16"]
SMALL += ["average=0.5", "preview_every=0"]


def captured() -> NerfTexture:
    """The small texture, on a ball with room for pieces."""
    model, ball = small_texture().model, icosphere(30)
    mesh = Mesh(0.6 * ball.vertices, ball.faces, name="ball")
    base = replace(model.base, mesh=mesh, scan=0.58 * ball.vertices)
    return NerfTexture(replace(model, base=base, frames=face_frames(mesh)))
