"""A Mitsuba scene with the plugin `decoded_field`: lava grown on a knot, decoded where rays meet the surface.

A bundled model keeps 16 numbers at each vertex, and a small network makes colours and heights of
them at every point in between, so the picture has detail far below the distance of vertices. Run it as

    python scenes/decoded_field.py [OUT.png]

and look at decoded.png: the path-traced knot, and the height alone as `feature` sees it.
"""

import sys

import mitex.plugins  # noqa: F401  # isort: skip  (before Mitsuba: it finds the LLVM that Dr.Jit needs)
import mitsuba as mi
import numpy as np

from mitex.images import write_image
from mitex.mesh import embedded
from mitex.methods.nca import NcaTexture
from mitex.render import tone
from mitex.scenes import mesh_shape

mi.set_variant("llvm_ad_rgb")

RELIEF = 0.03  # of the bumps, from the lowest to the highest point [mesh units]


def load_knot(model: str, steps: int) -> mi.Mesh:
    """The knot with the maps of a model: a cell of the texture sits at each vertex, so rows are in order."""
    mesh = embedded("knot")
    fields = NcaTexture.load(model).fields(mesh, seed=1, steps=steps)
    # The network runs at each evaluation of the material: a simple one, and short paths, take a minute.
    matte = {"type": "diffuse", "reflectance": fields["albedo"]}
    bsdf = {"type": "bumpmap", "height": fields["height"], "scale": RELIEF, "material": matte}
    return mesh_shape(mesh, bsdf, smooth=True)


def main(
    path: str = "decoded.png", model: str = "lava", steps: int = 200, resolution: int = 256, spp: int = 16
) -> None:
    """Renders the picture to `path` with `spp` paths per pixel."""
    camera = mi.ScalarTransform4f().look_at(origin=[0, 0.4, 4.2], target=[0.05, 0, 0], up=[0, 1, 0])
    lamp = mi.ScalarTransform4f().look_at(origin=[-2.5, 4, 2.5], target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": resolution, "height": resolution}
    scene = mi.load_dict(
        {
            "type": "scene",
            "knot": load_knot(model, steps),
            "lamp": {"type": "rectangle", "to_world": lamp, "emitter": {"type": "area", "radiance": 30.0}},
            "sky": {"type": "constant", "radiance": 0.6},
            "sensor": {"type": "perspective", "fov": 28, "to_world": camera, "film": film},
        }
    )
    traced = mi.render(scene, integrator=mi.load_dict({"type": "path", "max_depth": 2}), spp=spp)

    # `name` is that of the texture in the bump map; its image has all channels of the decoder.
    feature = mi.load_dict({"type": "feature", "name": "nested_texture", "antialias": 2})
    channels = np.array(mi.render(scene, integrator=feature))
    height = channels[..., 4:5].clip(0, 1).repeat(3, axis=2)
    print(write_image(path, np.hstack([tone(np.array(traced)[..., :3]), height])))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "decoded.png")
