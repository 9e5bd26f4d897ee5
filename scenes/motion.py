"""The `motion` integrator: how three vector fields on a vase move on the picture.

The fields turn about the vertical axis, go up, and follow two strokes drawn on the vase. Hue is the direction
on the picture: red to the right, yellow-green down, cyan to the left, violet up. What moves slowly is pale.
Run it as

    python scenes/motion.py [OUT.png]

and look at motion.png. The script prints how fast each field moves at most.
"""

import sys

import mitex.plugins  # noqa: F401  # isort: skip  (before Mitsuba: it finds the LLVM that Dr.Jit needs)
import mitsuba as mi
import numpy as np
from PIL import Image

from mitex.images import write_image
from mitex.mesh import Mesh, embedded
from mitex.mesh.fields import stroke_vectors, vector_field
from mitex.render import sheet
from mitex.scenes import mesh_shape

mi.set_variant("llvm_ad_rgb")

STROKES = [
    np.array([[-0.6, 0.1, 0.6], [0.0, 0.5, 0.6], [0.5, 0.1, 0.6]]),
    np.array([[0.5, -0.5, 0.4], [-0.5, -0.5, 0.4]]),
]


def motion(mesh: Mesh, field: np.ndarray, side: int) -> np.ndarray:
    """Motion to the right and down [pixels per unit time], depth and coverage: (side, side, 4)."""
    shape = mesh_shape(mesh)
    shape.add_attribute("vertex_motion", 3, field.ravel().tolist())
    view = mi.ScalarTransform4f().look_at([0, 0.6, 3.6], [0, 0, 0], [0, 1, 0])
    film = {"type": "hdrfilm", "width": side, "height": side}
    sensor = {"type": "perspective", "fov": 36, "to_world": view, "film": film}
    integrator = {"type": "motion", "antialias": 3}
    scene = mi.load_dict({"type": "scene", "integrator": integrator, "shape": shape, "sensor": sensor})
    return mi.render(scene).numpy()


def speed(image: np.ndarray) -> np.ndarray:
    """Of a picture of `motion` [pixels per unit time]."""
    return np.hypot(image[..., 0], image[..., 1])


def colours(image: np.ndarray, fastest: float) -> np.ndarray:
    """(side, side, 3) sRGB: the direction as hue, the speed as saturation, white behind the mesh."""
    hue = np.arctan2(image[..., 1], image[..., 0]) / (2 * np.pi) % 1.0
    saturation = np.clip(speed(image) / fastest, 0.0, 1.0) * image[..., 3]
    value = 1.0 - 0.1 * image[..., 3]  # so that what stands still is told from the background
    hsv = np.uint8(np.round(255 * np.stack([hue, saturation, value], axis=2)))
    return np.asarray(Image.fromarray(hsv, "HSV").convert("RGB"), np.float32) / 255


def main(out: str = "motion.png", side: int = 384) -> None:
    mesh = embedded("vase").normalised()[0]
    fields = {"about-y": "about-y", "up": "up", "along two strokes": stroke_vectors(mesh, STROKES)}
    images = {name: motion(mesh, vector_field(mesh, field), side) for name, field in fields.items()}
    for name, image in images.items():
        print(f"{name}: up to {speed(image).max():.0f} pixels per unit time")
    fastest = 0.7 * max(speed(image).max() for image in images.values())
    pictures = [colours(image, fastest) for image in images.values()]
    print(write_image(out, sheet(pictures, columns=3, labels=list(images), cell=side)))


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "motion.png")
