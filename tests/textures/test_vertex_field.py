"""vertex_field: analytic values through standard BSDFs, with and without UVs, parameters, gradients."""

import numpy as np
import pytest

from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError
from mitex.runtime.upload import upload
from tests.textures.helpers import (
    BUMPS,
    GREY,
    LIGHT,
    NORMAL,
    NORMALS,
    QUAD,
    SLOPE,
    grey_radiance,
    quad,
    radiance,
    sphere_picture,
)

QUAD_UV = np.array([(0.1, 0), (0.7, 0.2), (0.5, 0.9), (0.2, 0.8)], np.float32)  # skewed on purpose


def field(mi, data: np.ndarray, **options) -> dict:
    return {"type": "vertex_field", "data": upload(mi.TensorXf, np.asarray(data, np.float32))} | options


@pytest.mark.parametrize("uv", [None, QUAD_UV, np.zeros_like(QUAD_UV)], ids=["none", "skewed", "degenerate"])
def test_linear_reflectance_is_exact(mi, points, uv):
    x, y = points
    data = 0.5 + QUAD[:, :2] @ np.array([(0.2, 0.1, -0.3), (0.1, -0.2, 0.1)])
    shape = quad(mi, {"type": "diffuse", "reflectance": field(mi, data, raw=True)}, uv)
    expected = 0.5 + np.stack((x, y), axis=1) @ np.array([(0.2, 0.1, -0.3), (0.1, -0.2, 0.1)])
    np.testing.assert_allclose(radiance(mi, shape, x, y), expected, atol=2e-6)


def test_srgb_is_decoded_for_colours_only(mi, points):
    x, y = points
    data = 0.5 + 0.7 * QUAD[:, :1] * np.array([[1, -1, 0.5]])  # leaves [0, 1] at the rim
    shape = quad(mi, {"type": "diffuse", "reflectance": field(mi, data)})
    encoded = 0.5 + 0.7 * x[:, None] * np.array([[1, -1, 0.5]])
    expected = srgb_to_linear(encoded.clip(0, 1))
    np.testing.assert_allclose(radiance(mi, shape, x, y), expected, atol=2e-5)

    texture = mi.load_dict(field(mi, data))
    scene = mi.load_dict({"type": "scene", "shape": shape})
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(mi.Float(x), mi.Float(y), 3), mi.Vector3f(0, 0, -1)))
    np.testing.assert_allclose(np.array(texture.eval_3(si)).T, encoded, atol=2e-6)
    np.testing.assert_allclose(texture.eval_1(si).numpy(), encoded[:, 0], atol=2e-6)


@pytest.mark.parametrize(
    ("channel", "channels"), [(0, (0, 1, 2)), (2, (2, 3, 4)), (3, (3, 3, 3)), (4, (4, 4, 4))]
)
def test_channel_selects(mi, rng, points, channel: int, channels: tuple[int, ...]):
    values = rng.uniform(0.1, 0.9, 5)
    data = np.broadcast_to(values, (4, 5))
    bsdf = {"type": "diffuse", "reflectance": field(mi, data, raw=True, channel=channel)}
    result = radiance(mi, quad(mi, bsdf), *points)
    np.testing.assert_allclose(result, np.broadcast_to(values[list(channels)], (50, 3)), atol=1e-6)


def test_scale_and_offset_come_before_decoding(mi, points):
    data = np.full((4, 3), -0.25)
    bsdf = {"type": "diffuse", "reflectance": field(mi, data, scale=0.5, offset=0.5)}
    np.testing.assert_allclose(
        radiance(mi, quad(mi, bsdf), *points), srgb_to_linear(np.float64(0.375)), atol=1e-5
    )


@pytest.mark.parametrize("uv", [None, QUAD_UV], ids=["none", "skewed"])
def test_bump_of_a_linear_height_tilts_the_normal(mi, points, uv):
    bsdf = BUMPS | {"height": field(mi, 2 + QUAD[:, :2] @ SLOPE)}
    expected = grey_radiance(np.array([*-SLOPE, 1]))
    result = radiance(mi, quad(mi, bsdf, uv), *points, light=tuple(LIGHT))
    np.testing.assert_allclose(result, expected, atol=1e-5)
    assert abs(expected - 0.6 * -LIGHT[2]) > 0.05


def test_normal_map_tilts_the_normal(mi, points):
    bsdf = NORMALS | {"normalmap": field(mi, np.broadcast_to(0.5 * (NORMAL + 1), (4, 3)))}
    shape = quad(mi, bsdf, QUAD[:, :2])  # uv = xy, so that the tangent frame is the axes
    result = radiance(mi, shape, *points, light=tuple(LIGHT))
    np.testing.assert_allclose(result, grey_radiance(NORMAL), atol=1e-5)

    flat = NORMALS | {"normalmap": field(mi, np.full((4, 3), (0.5, 0.5, 1.0)))}
    plain = radiance(mi, quad(mi, GREY), *points, light=tuple(LIGHT))
    np.testing.assert_allclose(radiance(mi, quad(mi, flat), *points, light=tuple(LIGHT)), plain, atol=1e-5)


def test_constant_field_equals_a_constant(mi):
    """Albedo and roughness of a principled BSDF in a path-traced picture."""
    constant = {
        "type": "principled",
        "base_color": {"type": "rgb", "value": [0.2, 0.5, 0.8]},
        "roughness": 0.3,
    }
    data = np.broadcast_to([0.2, 0.5, 0.8, 0.3], (162, 4))
    varying = {
        "type": "principled",
        "base_color": field(mi, data, raw=True),
        "roughness": field(mi, data, channel=3),
    }
    expected = sphere_picture(mi, constant)
    np.testing.assert_allclose(sphere_picture(mi, varying), expected, rtol=1e-4, atol=1e-5)
    smoother = varying | {"roughness": field(mi, data, channel=3, scale=0.5)}
    assert np.abs(sphere_picture(mi, smoother) - expected).max() > 0.05 * expected.max()


def test_each_shape_has_its_own_field(mi):
    near, far = (
        quad(mi, {"type": "diffuse", "reflectance": field(mi, np.full((4, 1), v), raw=True)})
        for v in (0.3, 0.8)
    )
    params = mi.traverse(far)
    params["vertex_positions"] = (QUAD + np.array((2.5, 0, 0), np.float32)).ravel()
    params.update()
    emitter = {"type": "directional", "direction": [0, 0, -1], "irradiance": np.pi}
    scene = mi.load_dict({"type": "scene", "near": near, "far": far, "light": emitter})
    origin = mi.Point3f([0.1, 2.4, 0.3], [0.2, 0.1, -0.4], 3.0)
    si = scene.ray_intersect(mi.Ray3f(origin, mi.Vector3f(0, 0, -1)))
    albedo = si.bsdf().eval_diffuse_reflectance(si)
    np.testing.assert_allclose(albedo[0].numpy(), (0.3, 0.8, 0.3), atol=1e-6)


def test_update_through_traverse_changes_the_picture(mi, points):
    shape = quad(mi, {"type": "diffuse", "reflectance": field(mi, np.full((4, 3), 0.2), raw=True)})
    np.testing.assert_allclose(radiance(mi, shape, *points), 0.2, atol=1e-6)
    params = mi.traverse(shape)
    params["bsdf.reflectance.data"] = upload(mi.TensorXf, np.full((4, 3), 0.7, np.float32))
    params["bsdf.reflectance.scale"] = 0.5
    params.update()
    np.testing.assert_allclose(radiance(mi, shape, *points), 0.35, atol=1e-6)
    params["bsdf.reflectance.data"] = upload(mi.TensorXf, np.zeros((4, 2, 2), np.float32))
    with pytest.raises(ConfigError, match="shape"):
        params.update()


def test_gradient_through_a_path_tracer(mi):
    """The picture is linear in a raw albedo seen directly: one finite difference is exact."""
    from mitex.runtime.jit import dr

    shape = quad(mi, {"type": "diffuse", "reflectance": field(mi, np.full((4, 3), 0.5), raw=True)})
    to_world = mi.ScalarTransform4f().look_at(origin=[0.2, 0.1, 3], target=[0, 0, 0], up=[0, 1, 0])
    film = {"type": "hdrfilm", "width": 8, "height": 8, "rfilter": {"type": "box"}}
    sensor = {"type": "perspective", "fov": 30, "to_world": to_world, "film": film}
    integrator = {"type": "prb", "max_depth": 2}
    light = {"type": "directional", "direction": [0.1, 0.2, -1]}
    scene = mi.load_dict(
        {"type": "scene", "quad": shape, "sensor": sensor, "integrator": integrator, "light": light}
    )
    params = mi.traverse(scene)
    key = "quad.bsdf.reflectance.data"
    dr.enable_grad(params[key])
    params.update()
    dr.backward(dr.sum(mi.render(scene, params, spp=64, seed=3).array))
    gradient = np.array(dr.grad(params[key]))

    def total(value: np.ndarray) -> float:
        params[key] = upload(mi.TensorXf, value.astype(np.float32))
        params.update()
        return float(np.array(mi.render(scene, spp=64, seed=3), np.float64).sum())

    step = np.zeros((4, 3))
    step[1, 2] = 0.25
    assert gradient[1, 2] == pytest.approx((total(0.5 + step) - total(0.5 - step)) / 0.5, rel=1e-2)
    assert gradient.min() > 0


def test_mean_and_max(mi, rng):
    data = rng.uniform(0, 1, (30, 4))
    texture = mi.load_dict(field(mi, data))
    assert texture.mean()[0] == pytest.approx(srgb_to_linear(data[:, :3]).mean(), rel=1e-4)
    assert texture.max() == pytest.approx(srgb_to_linear(data[:, :3]).max(), rel=1e-4)
    assert mi.load_dict(field(mi, data, raw=True, channel=3)).mean()[0] == pytest.approx(
        data[:, 3].mean(), rel=1e-5
    )
    assert texture.is_spatially_varying()


def test_to_string(mi):
    text = str(mi.load_dict(field(mi, np.zeros((7, 5)), channel=1, scale=2.0)))
    assert text.startswith("VertexField[\n  vertices = 7,\n  channels = 5,\n  channel = 1,\n  scale = [2]")
    assert text.endswith("\n]")


def test_vector_is_one_channel(mi):
    assert "channels = 1" in str(mi.load_dict(field(mi, np.zeros(9))))


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"chanel": 1}, "chanel"),
        ({"channel": 3}, "use 0 to 2"),
        ({"channel": -1}, "use 0 to 2"),
        ({"data": None}, "data"),
    ],
)
def test_bad_properties_are_refused(mi, options: dict, problem: str):
    plugin = {k: v for k, v in (field(mi, np.zeros((4, 3))) | options).items() if v is not None}
    with pytest.raises(RuntimeError, match=problem):
        mi.load_dict(plugin)


def test_shapes_that_are_no_meshes_show_the_offset(mi, points):
    x, y = points
    texture = field(mi, np.full((4, 1), 0.5), raw=True, offset=0.1)
    ball = mi.load_dict(
        {"type": "sphere", "radius": 2.0, "bsdf": {"type": "diffuse", "reflectance": texture}}
    )
    scene = mi.load_dict({"type": "scene", "ball": ball})
    si = scene.ray_intersect(mi.Ray3f(mi.Point3f(mi.Float(x), mi.Float(y), 3), mi.Vector3f(0, 0, -1)))
    np.testing.assert_allclose(si.bsdf().eval_diffuse_reflectance(si)[0].numpy(), 0.1, atol=1e-6)


def test_other_variants(mi, points):
    """Registration follows the variant; mono shows luminance, spectral has no colours, scalar is refused."""
    before = mi.variant()
    try:
        mi.set_variant("llvm_ad_mono")
        texture = field(mi, np.full((4, 3), (0.2, 0.5, 0.7)), raw=True)
        value = radiance(mi, quad(mi, {"type": "diffuse", "reflectance": texture}), *points)
        np.testing.assert_allclose(value, 0.2 * 0.212671 + 0.5 * 0.715160 + 0.7 * 0.072169, atol=1e-5)
        mi.set_variant("llvm_ad_spectral")
        colour = mi.load_dict(field(mi, np.zeros((4, 3))))
        si = mi.load_dict({"type": "scene", "quad": quad(mi, {"type": "diffuse"})}).ray_intersect(
            mi.Ray3f(mi.Point3f(0.1, 0.2, 3), mi.Vector3f(0, 0, -1))
        )
        assert colour.eval_1(si)[0] == 0
        with pytest.raises(ConfigError, match="rgb or mono"):
            colour.eval(si)
        mi.set_variant("scalar_rgb")
        with pytest.raises(RuntimeError, match="llvm or cuda"):
            mi.load_dict(field(mi, np.zeros((4, 3))))
    finally:
        mi.set_variant(before)
    assert mi.load_dict(field(mi, np.zeros((4, 3)))).channel_count == 3
