"""The lit shell integrator: a field of smooth matter beside the sphere that it stands for."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mitex.colour import srgb_to_linear
from mitex.mesh import Similarity
from mitex.methods.nerf.field.lighting import reflectances
from mitex.plugins import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

init()

from mitex.textures.phong import Phong  # noqa: E402
from mitex.textures.shell_field import shell_field  # noqa: E402
from tests.integrators.test_shell import Ball  # noqa: E402
from tests.scenes.helpers import shell_scene  # noqa: E402

RADIUS = 0.5
KD = (0.2, 0.6, 0.4)


class Matt(Ball):
    """The ball of `test_shell`, which reflects light."""

    def __init__(self, density: float = 1000.0, kd=KD, ks: float = 0.0, glossiness: float = 30.0) -> None:
        super().__init__(density)
        self.kd, self.ks, self.glossiness = kd, ks, glossiness

    def extinction(self, points):
        return self.evaluate(points, None)[:2]

    def reflection(self, points, view):
        index = mi.UInt32(dr.compress(dr.norm(points) < RADIUS))
        normal = dr.normalize(mi.Vector3f(dr.gather(mi.Point3f, points, index)))
        zero = dr.zeros(mi.Float, dr.width(index))
        return index, Phong(normal, mi.Color3f(*self.kd) + zero, self.ks + zero, self.glossiness + zero)


def picture(field, spp: int = 256, side: int = 17, turn=None, **entries: Any) -> np.ndarray:
    """Of a field, or of a sphere in its place, under the entries' light."""
    carried = field and shell_field(field, Similarity(np.zeros(3), 1.0), turn)
    scene: dict[str, Any] = {
        "type": "scene",
        "integrator": {"type": "lit_shell", "field": carried} if field else {"type": "path", "max_depth": 6},
        "sensor": {
            "type": "perspective",
            "fov": 20,
            "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "box"}},
        },
    }
    if not field:
        matt = {"type": "diffuse", "reflectance": {"type": "rgb", "value": list(KD)}}
        scene["ball"] = {"type": "sphere", "radius": RADIUS, "bsdf": matt}
    return np.array(mi.render(mi.load_dict(scene | entries), spp=spp))


SKY = {"type": "constant", "radiance": 0.7}
LAMP = {"type": "point", "position": [2, 3, 4], "intensity": {"type": "rgb", "value": 40.0}}
FLOOR = {
    "type": "rectangle",
    "to_world": mi.ScalarTransform4f().translate([0, -RADIUS, 0]).rotate([1, 0, 0], -90).scale(3),
}


def test_a_dense_matt_ball_looks_as_a_diffuse_sphere():
    """Under a sky and a lamp, on a floor which it shades and which lights it from below."""
    lights: dict[str, Any] = {"sky": SKY, "lamp": LAMP, "floor": FLOOR}
    ours, theirs = picture(Matt(), **lights), picture(None, **lights)
    inner = np.s_[4:13, 4:13]
    np.testing.assert_allclose(ours[inner], theirs[inner], rtol=0.1)
    np.testing.assert_allclose(ours.mean((0, 1)), theirs.mean((0, 1)), rtol=0.03)


def test_white_matter_under_an_even_sky_vanishes():
    """The furnace: nothing is lost, however often a path is scattered."""
    for field in (Matt(kd=(1, 1, 1)), Matt(kd=(0.4, 0.4, 0.4), ks=0.6), Matt(2.0, kd=(1, 1, 1))):
        image = picture(field, sky={"type": "constant", "radiance": 1.0})
        np.testing.assert_allclose(image.mean(), 1.0, rtol=0.02)


def test_more_than_all_light_is_never_sent_back():
    image = picture(Matt(kd=(1, 1, 1), ks=1.0), sky={"type": "constant", "radiance": 1.0})
    np.testing.assert_allclose(image[8, 8], 1.0, rtol=0.03)


def test_thin_matter_shows_its_share_of_the_light():
    """Beer and Lambert along the way through the middle; a sky lights all of it alike."""
    density = 0.5
    image = picture(Matt(density), spp=2048, side=3, sky={"type": "constant", "radiance": 1.0})
    opacity = 1 - math.exp(-density * 2 * RADIUS)
    # Light that was scattered once: kd of what falls there, a little less where the ball shades itself.
    expected = 1 - opacity + opacity * np.array(KD)
    np.testing.assert_allclose(image[1, 1], expected, rtol=0.1)


def test_matter_that_was_learned_from_a_photo_looks_like_it_in_an_even_light():
    """Under the light that it was learned in, of mean 1, it has the photo's colours in both integrators."""
    photo = np.array([0.25, 0.45, 0.15])
    light = upload(mi.TensorXf, np.array([math.sqrt(4 * math.pi), *[0.0] * 15], np.float32))

    class Learned(Matt):
        def reflection(self, points, view):
            index, phong = super().reflection(points, view)
            phong.diffuse, phong.specular = reflectances(phong.diffuse, phong.specular, light)
            return index, phong

    field = Learned(kd=(photo**2.4).tolist())
    field.colour = tuple(photo.tolist())
    own = mi.render(shell_scene(field, fov=20, side=17), spp=16)
    lit = picture(field, sky={"type": "constant", "radiance": 1.0})
    np.testing.assert_allclose(np.array(own)[8, 8], srgb_to_linear(photo), rtol=0.02)
    np.testing.assert_allclose(lit[8, 8], srgb_to_linear(photo), rtol=0.05)


def test_what_stands_in_the_light_shades_the_field():
    screen = {
        "type": "rectangle",
        "to_world": mi.ScalarTransform4f().translate([1, 1.5, 2]).rotate([1, 0, 0], -36).scale(0.6),
    }
    lit, shaded = picture(Matt(), lamp=LAMP), picture(Matt(), lamp=LAMP, screen=screen)
    assert lit[8, 8].min() > 0.05 and shaded[8, 8].max() < 0.1 * lit[8, 8].min()


def test_a_mirrored_lamp_is_where_phong_has_it():
    """The highlight is at the normal halfway between eye and lamp, as bright as the lobe says."""
    lamp = {"type": "directional", "direction": [0, 0, -1], "irradiance": 1.0}
    image = picture(Matt(kd=(0, 0, 0), ks=0.5, glossiness=20.0), side=33, lamp=lamp)
    np.testing.assert_allclose(image[16, 16], 0.5 * 21 / (2 * math.pi), rtol=0.05)
    assert image[16, 16, 0] > 5 * image[16, 8, 0]


def test_normals_turn_with_the_field():
    class Striped(Matt):
        """With normals along the field's own x everywhere."""

        def reflection(self, points, view):
            index, phong = super().reflection(points, view)
            phong.normal = mi.Vector3f(1, 0, 0) + 0 * phong.normal
            return index, phong

    lamp = {"type": "directional", "direction": [0, 0, -1], "irradiance": 1.0}
    turn = np.array([[0.0, 0, 1], [0, 1, 0], [-1, 0, 0]]).T  # x to z, towards the eye
    dark, bright = picture(Striped(), lamp=lamp), picture(Striped(), lamp=lamp, turn=turn)
    assert dark[8, 8].max() < 1e-3
    np.testing.assert_allclose(bright[8, 8], np.array(KD) / math.pi, rtol=0.05)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({}, "lit_shell: 'field' is not a shell_field that reflects light"),
        ({"field": Ball()}, "lit_shell: 'field' is not a shell_field that reflects light"),
        ({"field": Matt(), "max_depth": 0}, "lit_shell: 'max_depth' is 0"),
    ],
)
def test_what_is_refused(wrong, message):
    wrong = {k: shell_field(v, Similarity(np.zeros(3), 1.0)) if k == "field" else v for k, v in wrong.items()}
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict({"type": "lit_shell"} | wrong)
