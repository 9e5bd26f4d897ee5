"""The shell integrator: depth compositing, shadows, silhouettes, gradients, against known answers."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError
from mitex.mesh import Similarity
from mitex.plugins import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

init()

from mitex.render.framing import rotation  # noqa: E402
from mitex.textures import shell_field as module  # noqa: E402
from mitex.textures.shell_field import shell_field  # noqa: E402
from tests.scenes.helpers import shell_scene  # noqa: E402

COLOUR = (0.2, 0.6, 0.4)


class Ball:
    """Of radius 0.5 with one density and one colour."""

    step = 1 / 64

    def __init__(self, density: float = 1000.0, colour=COLOUR) -> None:
        self.density, self.colour = mi.Float(density), colour
        self.mask = upload(mi.TensorXu8, np.ones((8, 8, 8), np.uint8))

    def parameters(self):
        return {"density": self.density}

    def parameters_changed(self):
        pass

    def evaluate(self, points, view):
        return self.values(mi.UInt32(dr.compress(dr.norm(points) < 0.5)))

    def values(self, index):
        if not dr.width(index):
            return index, mi.Float(), mi.Color3f()
        zero = dr.zeros(mi.Float, dr.width(index))
        return index, self.density + zero, mi.Color3f(*self.colour) + zero


def picture(field, *, spp=16, turn=None, place=None, side=33, seed=0, **entries: Any):
    scene = shell_scene(field, fov=40, side=side, place=place, turn=turn, **entries)
    return np.array(mi.render(scene, spp=spp, seed=seed))


def wall(z: float, **more):
    where = mi.ScalarTransform4f().translate([0, 0, z]).scale(4)
    return {"type": "rectangle", "to_world": where, **more}


BRIGHT = {"emitter": {"type": "area", "radiance": {"type": "rgb", "value": [0.7, 0.1, 0.3]}}}


def test_an_opaque_field_shows_its_colour_before_what_is_behind():
    image = picture(Ball(), wall=wall(-1, **BRIGHT))
    np.testing.assert_allclose(image[16, 16], srgb_to_linear(np.array(COLOUR, np.float32)), atol=5e-3)
    np.testing.assert_allclose(image[1, 1], [0.7, 0.1, 0.3], atol=1e-4)


def test_what_is_in_front_covers_the_field():
    np.testing.assert_allclose(picture(Ball(), wall=wall(1, **BRIGHT))[16, 16], [0.7, 0.1, 0.3], atol=1e-4)


def test_a_wall_through_the_middle_leaves_the_front_half():
    """Beer: the ray's way through the field ends at the wall."""
    colour = picture(Ball(2.0), spp=256, wall=wall(0, **BRIGHT))[16, 16]
    passes = math.exp(-2.0 * 0.5)
    own = srgb_to_linear(np.array(COLOUR, np.float32))
    expected = (1 - passes) * own + passes * np.array([0.7, 0.1, 0.3])
    np.testing.assert_allclose(colour, expected, atol=1e-2)


def test_the_field_casts_its_shadow():
    """A lamp above a floor, the field between: below it the direct light is what it lets pass."""
    entries: dict[str, Any] = {
        "lamp": {"type": "point", "position": [0, 3, 0], "intensity": {"type": "rgb", "value": 20.0}},
        "floor": {
            "type": "rectangle",
            "to_world": mi.ScalarTransform4f().translate([0, -0.8, 0]).rotate([1, 0, 0], -90).scale(5),
        },
        "sensor": {
            "type": "perspective",
            "fov": 20,
            "to_world": mi.ScalarTransform4f().look_at([3, 0.2, 3], [0, -0.8, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": 33, "height": 33, "rfilter": {"type": "box"}},
        },
    }
    clear, thin, dense = (
        picture(Ball(d, (0, 0, 0)), spp=256, **entries)[16, 16].mean() for d in (1e-6, 1.0, 1000.0)
    )
    assert clear > 0.1
    np.testing.assert_allclose(thin / clear, math.exp(-1.0), rtol=5e-2)
    assert dense < 1e-3 * clear


def test_a_field_can_be_moved_scaled_and_turned():
    class Half(Ball):
        def evaluate(self, points, view):
            return self.values(dr.compress((dr.norm(points) < 0.5) & (points.x > 0)))

    half = math.radians(90)
    up = np.array([[math.cos(half), -math.sin(half), 0], [math.sin(half), math.cos(half), 0], [0, 0, 1]])
    upper = picture(Half(), turn=up, wall=wall(-1, **BRIGHT))  # x turns to y: the upper half
    assert upper[14, 16, 0] < 0.1 < upper[18, 16, 0]
    small = picture(Ball(), place=Similarity(np.array([0.0, 0.0, 0.0]), 0.5), wall=wall(-1, **BRIGHT))
    large = picture(Ball(), wall=wall(-1, **BRIGHT))
    covered = [(image[..., 1] > 0.2).mean() for image in (small, large)]
    np.testing.assert_allclose(covered[1] / covered[0], 4, rtol=0.25)


def test_parts_of_unequal_size_are_seen_as_a_whole(monkeypatch: pytest.MonkeyPatch):
    turn = rotation(0.0)  # has a zero with a sign
    whole = picture(Ball(), turn=turn, wall=wall(-1, **BRIGHT))
    monkeypatch.setattr(module, "CHUNK", 700)
    np.testing.assert_allclose(
        picture(Ball(), turn=turn, wall=wall(-1, **BRIGHT)), whole, rtol=1e-5, atol=1e-6
    )


def test_without_matter_it_is_a_path_tracer():
    entries: dict[str, Any] = {
        "floor": {"type": "sphere", "bsdf": {"type": "roughconductor", "alpha": 0.3}},
        "box": {"type": "cube", "to_world": mi.ScalarTransform4f().translate([1.2, -0.5, 0]).scale(0.5)},
        "sky": {"type": "constant", "radiance": 0.4},
        "lamp": wall(6, **BRIGHT),
    }
    ours = picture(Ball(0.0), spp=512, side=12, **entries)
    sensor = {
        "type": "perspective",
        "fov": 40,
        "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
        "film": {"type": "hdrfilm", "width": 12, "height": 12, "rfilter": {"type": "box"}},
    }
    path = {"type": "path", "max_depth": 6, "rr_depth": 99}
    theirs = np.array(
        mi.render(mi.load_dict({"type": "scene", "integrator": path, "sensor": sensor} | entries), spp=512)
    )
    np.testing.assert_allclose(ours.mean((0, 1)), theirs.mean((0, 1)), rtol=2e-2)


def test_it_is_seen_through_glass():
    pane = {"type": "cube", "bsdf": {"type": "thindielectric"}}
    pane["to_world"] = mi.ScalarTransform4f().translate([0, 0, 1.5]).scale([2, 2, 0.01])
    colour = picture(Ball(), spp=256, pane=pane, sky={"type": "constant", "radiance": 0.5})[16, 16]
    bare = srgb_to_linear(np.array(COLOUR, np.float32))
    assert (np.abs(colour - bare) < 0.12).all() and colour[1] > 2 * colour[0]


def test_gradients_reach_the_fields_parameters():
    def image(density):
        return shell_scene(Ball(density), fov=10, side=4, sky={"type": "constant", "radiance": 0.5})

    scene = image(1.5)
    params = mi.traverse(scene)
    key = next(k for k in params.keys() if k.endswith("density"))  # noqa: SIM118
    dr.enable_grad(params[key])
    params.update()
    dr.backward(dr.sum(mi.render(scene, params, spp=16, seed=1).array))
    sums = [np.array(mi.render(image(d), spp=16, seed=1)).sum() for d in (1.45, 1.55)]
    np.testing.assert_allclose(np.array(dr.grad(params[key]))[0], (sums[1] - sums[0]) / 0.1, rtol=2e-2)


@pytest.mark.parametrize(
    "wrong, message",
    [({"field": {"type": "constvolume", "value": 1.0}}, "shell_field"), ({"max_depth": 0}, "max_depth")],
)
def test_wrong_parameters_are_refused(wrong, message):
    integrator = {"type": "shell", "field": shell_field(Ball(), Similarity(np.zeros(3), 1.0))}
    with pytest.raises(RuntimeError, match=message):
        mi.load_dict(integrator | wrong)


def test_one_mask_stands_for_all_rays():
    field: Any = shell_field(Ball(), Similarity(np.zeros(3), 1.0))
    ray = mi.Ray3f(mi.Point3f([0.0, 0.1, 0.9], 0, -2), mi.Vector3f([0.0, 0.0, 0.0], 0, 1))
    pixels = field.march(ray, dr.full(mi.Float, 0.5, 3), mi.Bool(True))
    np.testing.assert_allclose(np.array(pixels.transmittance), [0, 0, 1], atol=1e-3)


@pytest.mark.parametrize("variant", ["scalar_rgb", "llvm_ad_mono", "llvm_ad_spectral"])
def test_other_variants_are_refused_in_words(variant):
    before = mi.variant() or "llvm_ad_rgb"
    try:
        mi.set_variant(variant)
        with pytest.raises(RuntimeError, match=f"'{variant}'; use llvm_ad_rgb or cuda_ad_rgb"):
            mi.load_dict({"type": "shell"})
        with pytest.raises(ConfigError, match="shell_field: it does not work"):
            shell_field(object(), Similarity(np.zeros(3), 1.0))  # pyright: ignore[reportArgumentType]
    finally:
        mi.set_variant(before)
