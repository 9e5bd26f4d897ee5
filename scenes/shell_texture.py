"""A captured texture on a vase, an automaton's texture on a mesh, and a ball of glass, in one picture.

repetition: python scenes/shell_texture.py RUN [OUT.png]

RUN is a finished run of `mitex fit nerf`.
"""

from __future__ import annotations

import sys

import numpy as np

import mitex
from mitex.colour import srgb_to_linear
from mitex.images import write_image
from mitex.mesh import Similarity, embedded
from mitex.methods.nca import NcaTexture
from mitex.methods.nerf import NerfTexture
from mitex.render import tone
from mitex.scenes.stage import mesh_shape

mi = mitex.init()

FLOOR = -1.0  # its height


def main(run: str, out: str = "shell.png", size: int = 1024, resolution: int = 384, spp: int = 32) -> None:
    """Mitsuba's own dictionaries, with the field given to the integrator as an object."""
    from mitex.textures.shell_field import shell_field

    applied = NerfTexture.load(run).apply(embedded("vase"), size=size)
    # The vase keeps its size in the scene; the field's cube goes with it.
    field = shell_field(applied, Similarity(np.array([-0.9, 0.0, 0.0]), 1.0))
    grown = NcaTexture.load("pebbles").apply(embedded("octopus"), resolution=None, keep_dense=True)
    scene = {
        "type": "scene",
        "integrator": {"type": "shell", "field": field, "max_depth": 8},
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
    colour = {"type": "mesh_attribute", "name": "vertex_color"}
    matte = mi.load_dict({"type": "diffuse", "reflectance": colour})
    shape = mesh_shape(mesh.with_vertices(vertices), matte, smooth=True)
    shape.add_attribute("vertex_color", 3, srgb_to_linear(asset.vertex_maps["albedo"]).ravel())
    return shape


if __name__ == "__main__":
    main(sys.argv[1], sys.argv[2] if len(sys.argv) > 2 else "shell.png")
