"""A radiance field, a mesh with a grown texture, and a ball of glass, in one path-traced picture.

The lamp and the sky light all of them, and each casts its shadow on the others.

usage: python scenes/shell_texture.py [OUT.png [RUN]]

RUN is a finished run of `mitex fit nerf`: its captured texture is then shown on a vase. Without one, the
field is a sponge by formula.
"""

from __future__ import annotations

import sys
from typing import Any

import numpy as np

import mitex
from mitex.images import write_image
from mitex.mesh import Similarity, embedded
from mitex.methods.nca import NcaTexture
from mitex.render import tone
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from mitex.scenes import mesh_shape
from mitex.textures.phong import Phong
from mitex.textures.shell_field import shell_field

mitex.init()

FLOOR = -1.0  # its height


class Sponge:
    """A ball of radius 0.9 of a gyroid: all that a `shell_field` needs to know of what it carries."""

    step = 1 / 64  # between samples along a ray [half sides of the cube]

    def __init__(self) -> None:
        self.mask = upload(mi.TensorXu8, np.ones((8, 8, 8), np.uint8))  # matter may be in all cells

    def extinction(self, points: mi.Point3f) -> tuple[mi.UInt32, mi.Float]:
        """Which points have matter, and its density."""
        value, _ = gyroid(points)
        index = mi.UInt32(dr.compress((value > 0.3) & (dr.norm(points) < 0.9)))
        return index, dr.full(mi.Float, 200.0, dr.width(index))

    def reflection(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, Phong]:
        """Which points have matter, and how it reflects: a matt colour, darker towards the middle."""
        index, _ = self.extinction(points)
        points = dr.gather(mi.Point3f, points, index)
        _, slope = gyroid(points)
        colour = mi.Color3f(0.95, 0.62, 0.3) * dr.square(dr.norm(points))
        zero = dr.zeros(mi.Float, dr.width(index))
        # On its outside the ball was cut out of the gyroid.
        outside = dr.norm(points) > 0.88
        normal = dr.normalize(dr.select(outside, mi.Vector3f(points), -slope))
        return index, Phong(normal, colour, zero, zero + 1)

    def evaluate(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, mi.Float, mi.Color3f]:
        """Density and colour in a light of its own, for the integrator `shell`."""
        index, density = self.extinction(points)
        return index, density, self.reflection(points, view)[1].diffuse


def gyroid(points: mi.Point3f) -> tuple[mi.Float, mi.Vector3f]:
    """A function that is positive on one side of the surface, and its gradient but for a factor."""
    (sin_x, cos_x), (sin_y, cos_y), (sin_z, cos_z) = (dr.sincos(9 * p) for p in points)
    slope = mi.Vector3f(
        cos_x * cos_y - sin_z * sin_x, cos_y * cos_z - sin_x * sin_y, cos_z * cos_x - sin_y * sin_z
    )
    return sin_x * cos_y + sin_y * cos_z + sin_z * cos_x, slope


def load_field(run: str | None, size: int) -> Any:
    """The captured texture of a run on a vase, or the sponge."""
    if run is None:
        return Sponge()
    from mitex.methods.nerf import NerfTexture

    return NerfTexture.load(run).apply(embedded("vase"), size=size)


def main(
    out: str = "shell.png", run: str | None = None, size: int = 1024, resolution: int = 384, spp: int = 32
) -> None:
    """Mitsuba's own dictionaries, with the field given to the integrator as an object."""
    # The field's cube keeps its size in the scene, and is moved to the left.
    field = shell_field(load_field(run, size), Similarity(np.array([-0.9, 0.0, 0.0]), 1.0))
    grown = NcaTexture.load("pebbles").apply(embedded("octopus"), resolution=None, keep_dense=True)
    scene = {
        "type": "scene",
        # `shell` would show the field in its own light.
        "integrator": {"type": "lit_shell", "field": field, "max_depth": 8},
        "sensor": {
            "type": "perspective",
            "fov": 46,
            "to_world": mi.ScalarTransform4f().look_at([0.3, 1.1, 5.2], [0.05, -0.2, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": int(1.5 * resolution), "height": resolution},
        },
        "sky": {"type": "constant", "radiance": 0.8},
        "lamp": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().look_at([-3, 4, 3], [0, 0, 0], [0, 1, 0]),
            "emitter": {"type": "area", "radiance": {"type": "rgb", "value": 9.0}},
        },
        "floor": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate([0, FLOOR, 0]).rotate([1, 0, 0], -90).scale(8),
        },
        "glass": {
            "type": "sphere",
            "center": [0.15, -0.6, 1.2],
            "radius": 0.4,
            "bsdf": {"type": "dielectric"},
        },
        "mesh": textured(grown, [1.0, 0.1]),
    }
    picture = np.array(mi.render(mi.load_dict(scene), spp=spp))[..., :3]
    print(write_image(out, tone(picture)))


def textured(asset, place):
    """An asset's mesh, radius 0.85, on the floor at (x, z), with its base colour at the vertices."""
    mesh = asset.mesh.normalised()[0]
    vertices = 0.85 * mesh.vertices
    vertices += np.array([place[0], FLOOR - vertices[:, 1].min(), place[1]])
    colour = {"type": "vertex_field", "data": upload(mi.TensorXf, asset.vertex_maps["albedo"])}
    return mesh_shape(mesh.with_vertices(vertices), {"type": "diffuse", "reflectance": colour}, smooth=True)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "shell.png", sys.argv[2] if len(sys.argv) > 2 else None)
