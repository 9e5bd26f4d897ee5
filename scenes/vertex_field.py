"""A Mitsuba scene with the plugins `vertex_field` and `feature`: a ring with five channels at its vertices.

The channels are a colour, a roughness and a height. `vertex_field` hands them to a
principled BSDF below a bump map, `feature` images all five at once. Run it as

    python scenes/vertex_field.py [OUT.png]

and look at ring.png: the path-traced ring, then its colour, roughness and height as `feature` sees them.
"""

import sys

import mitex.plugins  # noqa: F401  # isort: skip  (before Mitsuba: it finds the LLVM that Dr.Jit needs)
import mitsuba as mi
import numpy as np

from mitex.mesh import Mesh
from mitex.runtime.upload import upload
from mitex.scenes import mesh_shape

mi.set_variant("llvm_ad_rgb")

ROUND, ACROSS = 720, 240  # vertices around the ring and around its tube


def ring() -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Vertices (V, 3), faces (F, 3) and the two angles (V, 2) [rad] of a torus around +y."""
    a, b = np.meshgrid(np.arange(ROUND), np.arange(ACROSS), indexing="ij")
    around, across = 2 * np.pi * a / ROUND, 2 * np.pi * b / ACROSS
    radius = 1 + 0.42 * np.cos(across)
    vertices = np.stack((radius * np.cos(around), 0.42 * np.sin(across), -radius * np.sin(around)), axis=-1)

    def index(i: np.ndarray, j: np.ndarray) -> np.ndarray:
        return (i % ROUND) * ACROSS + j % ACROSS

    corners = index(a, b), index(a + 1, b), index(a + 1, b + 1), index(a, b + 1)
    faces = np.concatenate(
        [np.stack([corners[k] for k in f], -1).reshape(-1, 3) for f in ((0, 1, 2), (0, 2, 3))]
    )
    return vertices.reshape(-1, 3), faces, np.stack((around, across), axis=-1).reshape(-1, 2)


def channels(angles: np.ndarray) -> np.ndarray:
    """(V, 5) values: sRGB colour, roughness, height [mesh units], of a basket weave."""
    u, v = 48 * angles[:, 0] / (2 * np.pi), 16 * angles[:, 1] / (2 * np.pi)
    over = (np.floor(u) + np.floor(v)) % 2 == 0  # which of the two strands lies on top
    along, side = np.where(over, (u % 1, v % 1), (v % 1, u % 1))
    height = 0.03 * (0.2 + 0.8 * np.sin(np.pi * along)) * np.sin(np.pi * side) ** 0.4
    strand = np.where(over[:, None], (0.86, 0.55, 0.24), (0.16, 0.42, 0.47))
    colour = strand * (0.3 + 0.7 * (height / height.max())[:, None])
    return np.column_stack((colour, np.where(over, 0.25, 0.6), height)).astype(np.float32)


def load_ring() -> mi.Mesh:
    """The ring as a Mitsuba mesh, which needs no UVs."""
    vertices, faces, angles = ring()
    data = upload(mi.TensorXf, channels(angles))
    bsdf = {
        "type": "bumpmap",
        "height": {"type": "vertex_field", "data": data, "channel": 4},
        "material": {
            "type": "principled",
            "base_color": {"type": "vertex_field", "data": data},  # channels 0 to 2, decoded from sRGB
            "roughness": {"type": "vertex_field", "data": data, "channel": 3},
            "specular": 0.5,
        },
    }
    return mesh_shape(Mesh(vertices, faces, name="ring"), bsdf, smooth=True)


def main(path: str = "ring.png", spp: int = 128) -> None:
    """Renders the picture to `path` with `spp` paths per pixel."""
    camera = mi.ScalarTransform4f().look_at(origin=[0, 2.9, 4.0], target=[0, -0.1, 0], up=[0, 1, 0])
    lamp = mi.ScalarTransform4f().look_at(origin=[-2.5, 4, 2.5], target=[0, 0, 0], up=[0, 1, 0])
    lamp = lamp @ mi.ScalarTransform4f().scale(1.2)
    floor = mi.ScalarTransform4f().translate([0, -0.42, 0]).rotate([1, 0, 0], -90).scale(20)
    film = {"type": "hdrfilm", "width": 480, "height": 360}
    scene = mi.load_dict(
        {
            "type": "scene",
            "ring": load_ring(),
            "floor": {
                "type": "rectangle",
                "to_world": floor,
                "bsdf": {"type": "diffuse", "reflectance": 0.35},
            },
            "lamp": {"type": "rectangle", "to_world": lamp, "emitter": {"type": "area", "radiance": 22.0}},
            "sky": {"type": "constant", "radiance": 0.45},
            "sensor": {"type": "perspective", "fov": 38, "to_world": camera, "film": film},
        }
    )
    traced = mi.render(scene, integrator=mi.load_dict({"type": "path", "max_depth": 5}), spp=spp)

    # `name` finds the texture in the ring's BSDF; the floor has none called so and shows the background.
    feature = mi.load_dict({"type": "feature", "name": "base_color", "antialias": 4, "background": 0.0})
    image = np.array(mi.render(scene, integrator=feature))
    assert image.shape == (360, 480, 5)

    picture = np.array(mi.util.convert_to_bitmap(traced)) / 255.0
    grey = [np.repeat(image[..., c : c + 1] / image[..., c].max(), 3, axis=-1) for c in (3, 4)]
    sheet = np.vstack((np.hstack((picture, image[..., :3])), np.hstack(grey)))
    mi.Bitmap((255 * sheet.clip(0, 1)).round().astype(np.uint8)).write(path)
    print(path)


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "ring.png")
