"""A Mitsuba scene with the plugins `texel_field` and `feature`: a vase painted on the texels of its UVs.

The map has eight channels: a colour, a roughness, a height, and the colour of the chart that a texel belongs
to. `texel_field` hands the first five to a principled BSDF below a bump map; since it knows the charts,
its filter never mixes texels that are not neighbours on the vase. Run it as

    python scenes/texel_field.py [OUT.png]

and look at vase.png: the path-traced vase, and its charts as `feature` sees them.
"""

import sys

import mitex.plugins  # noqa: F401  # isort: skip  (before Mitsuba: it finds the LLVM that Dr.Jit needs)
import mitsuba as mi
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

from mitex.atlas import Atlas
from mitex.geometry.tangents import Split, split_at_seams
from mitex.mesh import embedded
from mitex.runtime.upload import upload
from mitex.scenes import mesh_shape

mi.set_variant("llvm_ad_rgb")

RESOLUTION = 1024  # [texels]
BANDS, TEETH = 7.0, 14  # bands per unit of height, and teeth of their zigzag around the vase
PALETTE = np.array([(0.13, 0.25, 0.36), (0.91, 0.84, 0.70), (0.76, 0.33, 0.17)])  # sRGB


def charts(split: Split) -> np.ndarray:
    """(F,) the number of each face's chart: faces that hang together after the cut along the seams."""
    a, b = split.faces[:, :2].ravel(), split.faces[:, 1:].ravel()
    edges = coo_array((np.ones(len(a), bool), (a, b)), shape=(len(split.uv), len(split.uv)))
    return connected_components(edges, directed=False)[1][split.faces[:, 0]]


def zigzag(position: np.ndarray) -> np.ndarray:
    """(H, W, 5) sRGB colour, roughness and height [mesh units] at the points (H, W, 3)."""
    turn = np.arctan2(position[..., 2], position[..., 0]) / (2 * np.pi)
    t = BANDS * position[..., 1] + 0.8 * np.abs((TEETH * turn) % 1 - 0.5)
    band, across = np.floor(t).astype(int) % len(PALETTE), t % 1
    relief = np.sqrt(np.sin(np.pi * across).clip(0, 1))  # rounded bands with grooves between them
    colour = PALETTE[band] * (0.35 + 0.65 * relief[..., None])
    roughness = np.array((0.2, 0.6, 0.35))[band]
    return np.concatenate((colour, roughness[..., None], 0.025 * relief[..., None]), axis=-1)


def load_vase() -> mi.Mesh:
    """The vase with its map."""
    vase = embedded("vase")
    atlas = Atlas.build(vase, RESOLUTION)
    split = split_at_seams(vase, atlas.uv)  # Mitsuba keeps one UV per vertex
    chart = np.where(atlas.face >= 0, charts(split)[atlas.face], -1)
    tints = np.random.default_rng(0).uniform(0.15, 1.0, (chart.max() + 2, 3))
    painted = zigzag(atlas.interpolate(vase.vertices[vase.faces]))
    texels = np.concatenate((painted, tints[chart]), axis=-1)

    shared = {
        "type": "texel_field",
        "data": upload(mi.TensorXf, texels.astype(np.float32)),
        "charts": upload(mi.TensorXf, chart.astype(np.float32)),
    }
    material = {
        "type": "principled",
        "base_color": shared,  # channels 0 to 2, decoded from sRGB
        "roughness": shared | {"channel": 3},
        "specular": 0.5,
    }
    bsdf = {"type": "bumpmap", "height": shared | {"channel": 4}, "material": material}
    return mesh_shape(vase, bsdf, smooth=True, split=split)


def main(path: str = "vase.png", spp: int = 128) -> None:
    """Renders the picture to `path` with `spp` paths per pixel."""
    camera = mi.ScalarTransform4f().look_at(origin=[0, 1.6, 4.2], target=[0, -0.05, 0], up=[0, 1, 0])
    lamp = mi.ScalarTransform4f().look_at(origin=[-2.5, 4, 2.5], target=[0, 0, 0], up=[0, 1, 0])
    floor = mi.ScalarTransform4f().translate([0, -0.96, 0]).rotate([1, 0, 0], -90).scale(20)
    film = {"type": "hdrfilm", "width": 400, "height": 480}
    scene = mi.load_dict(
        {
            "type": "scene",
            "vase": load_vase(),
            "floor": {
                "type": "rectangle",
                "to_world": floor,
                "bsdf": {"type": "diffuse", "reflectance": 0.35},
            },
            "lamp": {
                "type": "rectangle",
                "to_world": lamp @ mi.ScalarTransform4f().scale(1.2),
                "emitter": {"type": "area", "radiance": 22.0},
            },
            "sky": {"type": "constant", "radiance": 0.45},
            "sensor": {"type": "perspective", "fov": 28, "to_world": camera, "film": film},
        }
    )
    traced = mi.render(scene, integrator=mi.load_dict({"type": "path", "max_depth": 5}), spp=spp)

    # `name` finds the texture in the vase's BSDF; the floor has none called so and shows the background.
    feature = mi.load_dict({"type": "feature", "name": "base_color", "antialias": 3})
    image = np.array(mi.render(scene, integrator=feature))
    assert image.shape == (480, 400, 8)

    picture = np.array(mi.util.convert_to_bitmap(traced)) / 255.0
    sheet = np.hstack((picture, image[..., 5:]))
    mi.Bitmap((255 * sheet.clip(0, 1)).round().astype(np.uint8)).write(path)
    print(path)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "vase.png")
