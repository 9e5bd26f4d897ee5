"""texel_field: lookups against a slow reference, charts that do not bleed, BSDFs, gradients, `feature`."""

from typing import Any

import numpy as np
import pytest
import torch

from mitex.bridge import render
from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError
from mitex.runtime.upload import upload
from tests.textures.helpers import QUAD, quad, radiance, sphere_picture

UNIT = (QUAD[:, :2] + 1) / 2  # uv of the quad whose map covers it once


def field(mi, data: np.ndarray, charts: np.ndarray | None = None, **options) -> dict:
    plugin = {"type": "texel_field", "data": upload(mi.TensorXf, np.asarray(data, np.float32))} | options
    return (
        plugin if charts is None else plugin | {"charts": upload(mi.TensorXf, np.asarray(charts, np.float32))}
    )


def at(mi, uv: np.ndarray):
    """Surface interactions with the given (N, 2) uv."""
    si = mi.SurfaceInteraction3f()
    si.uv = mi.Point2f(
        upload(mi.Float, uv[:, 0].astype(np.float32)), upload(mi.Float, uv[:, 1].astype(np.float32))
    )
    return si


def lookups(mi, plugin: dict, uv: np.ndarray) -> np.ndarray:
    """(N, C) values of all channels."""
    texture = mi.load_dict(plugin)
    return np.stack([value.numpy() for value in texture.gather(texture.locate(at(mi, uv)))], axis=1)


def slow_weights(shape: tuple[int, int], uv: np.ndarray, charts=None, nearest: bool = False) -> np.ndarray:
    """(N, H * W) weights of every texel in every lookup, point by point and texel by texel."""
    height, width = shape
    matrix = np.zeros((len(uv), height * width))
    for n, (u, v) in enumerate(np.clip(uv.astype(np.float64), 0, 1)):
        x, y = u * width - 0.5, (1 - v) * height - 0.5
        around = []
        for row in (np.floor(y), np.floor(y) + 1):
            for column in (np.floor(x), np.floor(x) + 1):
                weight = (1 - abs(x - column)) * (1 - abs(y - row))
                r, c = int(np.clip(row, 0, height - 1)), int(np.clip(column, 0, width - 1))
                chart = 0 if charts is None else charts[r, c]
                if chart >= 0:
                    around.append((np.hypot(x - column, y - row), chart, weight, r * width + c))
        if not around:
            continue
        _, own, _, texel = min(around)
        if nearest:
            matrix[n, texel] = 1
            continue
        for _, chart, weight, texel in around:
            if chart == own:
                matrix[n, texel] += weight
        matrix[n] /= matrix[n].sum()
    return matrix


@pytest.fixture
def uv(rng) -> np.ndarray:
    """Lookups inside, at the texture's borders and corners, and beyond them."""
    inside, rim = rng.uniform(0, 1, (300, 2)), rng.uniform(0, 1, (40, 2))
    rim[:20, 0] = np.where(rim[:20, 0] < 0.5, 0.02, 0.99)
    rim[20:, 1] = np.where(rim[20:, 1] < 0.5, 0.001, 0.97)
    corners = np.array([(0, 0), (0, 1), (1, 0), (1, 1), (-0.4, 0.31), (0.62, 1.7), (3, -2)])
    return np.concatenate((inside, rim, corners)).astype(np.float32)


@pytest.fixture
def charts(rng) -> np.ndarray:
    """(6, 9) three charts and unused texels in disorder, and nothing but unused ones in one place."""
    chart = rng.choice([-1, 0, 1, 7], (6, 9), p=[0.25, 0.35, 0.25, 0.15])
    chart[3:, 5:8] = -1
    return chart


@pytest.mark.parametrize("kind", ["bilinear", "nearest"])
@pytest.mark.parametrize("masked", [False, True])
def test_lookup_equals_the_slow_reference(mi, rng, uv, charts, kind: str, masked: bool):
    data = rng.uniform(-1, 2, (6, 9, 5))
    plugin = field(mi, data, charts if masked else None, filter=kind, scale=2.0, offset=-0.25)
    weights = slow_weights((6, 9), uv, charts if masked else None, kind == "nearest")
    np.testing.assert_allclose(lookups(mi, plugin, uv), 2 * weights @ data.reshape(54, 5) - 0.25, atol=2e-5)
    unread = weights.sum(axis=1) == 0
    assert unread.any() == masked  # some lookups see unused texels only


@pytest.mark.parametrize("shape", [(1, 1), (1, 4), (5, 1)])
def test_thin_maps(mi, rng, uv, shape: tuple[int, int]):
    data = rng.uniform(0, 1, (*shape, 2))
    expected = slow_weights(shape, uv) @ data.reshape(-1, 2)
    np.testing.assert_allclose(lookups(mi, field(mi, data), uv), expected, atol=2e-6)


def test_orientation_is_that_of_the_atlas(mi):
    """Texel (r, c) shows u = (c + 0.5) / N, v = 1 - (r + 0.5) / N: what an atlas bakes comes back."""
    from mitex.atlas import Atlas

    corners = np.array([[(0, 0), (1, 0), (1, 1)], [(0, 0), (1, 1), (0, 1)]], np.float32)
    baked = Atlas.from_uv(corners, 16, 1).interpolate(corners)
    grid = np.random.default_rng(1).uniform(0.05, 0.95, (50, 2)).astype(np.float32)
    np.testing.assert_allclose(lookups(mi, field(mi, baked), grid), grid, atol=1e-5)
    top_left = np.array([[0.5 / 16, 1 - 0.5 / 16]])
    np.testing.assert_allclose(lookups(mi, field(mi, baked), top_left)[0], baked[0, 0], atol=1e-6)


@pytest.mark.parametrize("padded", [False, True])
def test_charts_do_not_bleed(mi, rng, padded: bool):
    """Chart 0 is columns 0 to 3, chart 1 columns 5 to 8; the texel between is unused or belongs to one."""
    data = np.full((4, 9, 3), 99.0)
    data[:, :4], data[:, 5:] = (0.2, 0.4, 0.6), (0.9, 0.1, 0.3)
    charts = np.full((4, 9), -1)
    charts[:, :4], charts[:, 5:] = 0, 1
    if padded:
        data[:, 4], charts[:, 4] = data[:, 3], 0
    left, right = rng.uniform(0, 1, (2, 200, 2))
    left[:, 0] *= 4 / 9
    right[:, 0] = (5 + 4 * right[:, 0]) / 9
    left[0], right[0], right[1] = (3.999 / 9, 0.3), (5.001 / 9, 0.3), (1, 1)
    plugin = field(mi, data, charts)
    np.testing.assert_allclose(lookups(mi, plugin, left), np.tile(data[0, 0], (200, 1)), atol=2e-7)
    np.testing.assert_allclose(lookups(mi, plugin, right), np.tile(data[0, 8], (200, 1)), atol=2e-7)
    plain = lookups(mi, field(mi, data), right)
    assert np.abs(plain - data[0, 8]).max() > 0.1  # without chart numbers it bleeds


def test_other_charts_are_not_touched_at_all(mi, rng):
    """A value that is not finite would survive a weight of 0."""
    data, charts = np.ones((2, 6, 1)), np.zeros((2, 6))
    charts[:, 3:] = 1
    texture = mi.load_dict(field(mi, data, charts))
    params = mi.traverse(texture)
    data[:, 3:] = np.nan
    params["data"] = upload(mi.TensorXf, data.astype(np.float32))
    params.update()
    left = rng.uniform(0, 0.499, (100, 2))
    np.testing.assert_allclose(texture.eval_1(at(mi, left)).numpy(), 1, atol=1e-6)
    assert np.isnan(texture.eval_1(at(mi, left + (0.5, 0))).numpy()).all()


def test_uv_that_is_no_number_reads_no_memory_beyond(mi):
    value = mi.load_dict(field(mi, np.ones((3, 3, 1)), offset=0.5)).eval_1(
        at(mi, np.array([(np.nan, 0.5), (np.inf, 0.5)]))
    )
    np.testing.assert_allclose(value.numpy(), (0.5, 1.5))


@pytest.mark.parametrize("kind", ["bilinear", "nearest"])
@pytest.mark.parametrize("masked", [False, True])
def test_gradient_is_the_transposed_lookup(mi, rng, uv, charts, kind: str, masked: bool):
    from mitex.runtime.jit import dr

    data, upstream = rng.uniform(0, 1, (6, 9, 2)), rng.normal(size=(len(uv), 2))
    texture = mi.load_dict(field(mi, data, charts if masked else None, filter=kind, scale=3.0))
    params = mi.traverse(texture)
    dr.enable_grad(params["data"])
    params.update()
    values = texture.gather(texture.locate(at(mi, uv)))
    loss: Any = sum(
        dr.sum(v * upload(mi.Float, w.astype(np.float32))) for v, w in zip(values, upstream.T, strict=True)
    )
    dr.backward(loss)
    gradient = dr.grad(params["data"]).numpy()
    weights = slow_weights((6, 9), uv, charts if masked else None, kind == "nearest")
    np.testing.assert_allclose(gradient.reshape(54, 2), 3 * weights.T @ upstream, atol=1e-4)

    direction = rng.normal(size=data.shape)

    def total(shifted: np.ndarray) -> float:
        plugin = field(mi, shifted, charts if masked else None, filter=kind, scale=3.0)
        return float((lookups(mi, plugin, uv).astype(np.float64) * upstream).sum())

    slope = total(data + 0.5 * direction) - total(data - 0.5 * direction)  # linear: one step is exact
    assert slope == pytest.approx(float((gradient * direction).sum()), rel=1e-4, abs=1e-3)


@pytest.mark.parametrize("masked", [False, True])
def test_slope_by_u_and_v(mi, rng, uv, charts, masked: bool):
    """`eval_1_grad` and the gradient to an attached uv against differences of the slow reference."""
    from mitex.runtime.jit import dr

    data = rng.uniform(0, 1, (6, 9, 1))
    used = charts if masked else None
    texture = mi.load_dict(field(mi, data, used, scale=2.0))
    h = 1e-5
    x, y = uv[:, 0] * 9 - 0.5, (1 - uv[:, 1]) * 6 - 0.5
    # Away from the creases at texel centres and half way between them, where the nearest texel changes.
    smooth = np.maximum(np.abs(x % 0.5 - 0.25), np.abs(y % 0.5 - 0.25)) < 0.24
    if masked:  # and from other changes of the nearest used one
        for step in ((h, 0), (-h, 0), (0, h), (0, -h)):
            same = (slow_weights((6, 9), uv + step, charts) > 0) == (slow_weights((6, 9), uv, charts) > 0)
            smooth &= same.all(axis=1)
    places = uv[smooth].astype(np.float64)
    assert len(places) > 100

    def exact(moved: np.ndarray) -> np.ndarray:
        return 2 * slow_weights((6, 9), moved, used) @ data.ravel()

    steps = np.array(((h, 0), (0, h)))
    expected = [(exact(places + step) - exact(places - step)) / (2 * h) for step in steps]
    result = np.array(texture.eval_1_grad(at(mi, places)))
    np.testing.assert_allclose(result, expected, rtol=1e-3, atol=5e-3)
    assert np.abs(result).max() > 1

    si = at(mi, places)
    dr.enable_grad(si.uv)
    dr.backward(dr.sum(texture.eval_1(si)))
    np.testing.assert_allclose(np.array(dr.grad(si.uv)), result, rtol=1e-3, atol=5e-3)


def test_slope_of_the_nearest_texel_is_zero(mi, rng, uv):
    texture = mi.load_dict(field(mi, rng.uniform(0, 1, (4, 4, 1)), filter="nearest"))
    assert not np.array(texture.eval_1_grad(at(mi, uv))).any()


def ramp(slope: tuple[float, float], side: int = 64) -> np.ndarray:
    """(N, N, 1) slope . (x, y) on the quad of the tests, where u = (x + 1) / 2."""
    centre = (np.arange(side) + 0.5) / side * 2 - 1
    return (slope[0] * centre[None, :] - slope[1] * centre[:, None])[..., None]


def test_reflectance_decodes_srgb(mi, points):
    x, y = (0.95 * p for p in points)
    data = 0.5 + 0.7 * ramp((0.4, 0.8)) * np.array([1, -1, 0.5])  # leaves [0, 1] at the rim
    encoded = 0.5 + 0.7 * (0.4 * x + 0.8 * y)[:, None] * np.array([[1, -1, 0.5]])
    shape = quad(mi, {"type": "diffuse", "reflectance": field(mi, data)}, UNIT)
    np.testing.assert_allclose(radiance(mi, shape, x, y), srgb_to_linear(encoded.clip(0, 1)), atol=1e-3)
    shape = quad(mi, {"type": "diffuse", "reflectance": field(mi, encoded.clip(0, 1)[None], raw=True)}, UNIT)
    middle = (2 * (np.arange(50) + 0.5) / 50 - 1).astype(np.float32)  # every texel's centre
    np.testing.assert_allclose(radiance(mi, shape, middle, 0 * middle), encoded.clip(0, 1), atol=1e-5)


@pytest.mark.parametrize(("channel", "channels"), [(0, (0, 1, 2)), (2, (2, 3, 4)), (3, (3, 3, 3))])
def test_channel_selects(mi, rng, points, channel: int, channels: tuple[int, ...]):
    values = rng.uniform(0.1, 0.9, 5)
    data = np.broadcast_to(values, (3, 4, 5))
    bsdf = {"type": "diffuse", "reflectance": field(mi, data, raw=True, channel=channel)}
    result = radiance(mi, quad(mi, bsdf, UNIT), *points)
    np.testing.assert_allclose(result, np.broadcast_to(values[list(channels)], (50, 3)), atol=1e-6)


LIGHT = np.array([0.3, 0.2, -1.0]) / np.linalg.norm([0.3, 0.2, -1.0])
NESTED = {"type": "diffuse", "reflectance": 0.6}


def test_bump_of_a_linear_height_tilts_the_normal(mi, points):
    slope = (0.3, -0.5)
    bsdf = {
        "type": "bumpmap",
        "height": field(mi, ramp(slope)),
        "bsdf": NESTED,
        "use_shadowing_function": False,
    }
    normal = np.array([-slope[0], -slope[1], 1]) / np.linalg.norm([*slope, 1])
    expected = 0.6 * np.dot(normal, -LIGHT)
    result = radiance(mi, quad(mi, bsdf, UNIT), *points, light=tuple(LIGHT))
    np.testing.assert_allclose(result, expected, atol=1e-4)
    assert abs(expected - 0.6 * -LIGHT[2]) > 0.05


def test_normal_map_tilts_the_normal(mi, points):
    normal = np.array([0.3, -0.2, 0.93])
    normal /= np.linalg.norm(normal)
    encoded = np.broadcast_to(0.5 * (normal + 1), (2, 2, 3))
    bsdf = {
        "type": "normalmap",
        "normalmap": field(mi, encoded),
        "bsdf": NESTED,
        "use_shadowing_function": False,
    }
    result = radiance(mi, quad(mi, bsdf, UNIT), *points, light=tuple(LIGHT))
    np.testing.assert_allclose(result, 0.6 * np.dot(normal, -LIGHT), atol=1e-5)


def test_constant_field_equals_a_constant(mi):
    """Albedo and roughness of a principled BSDF in a path-traced picture."""
    color = {"type": "rgb", "value": [0.2, 0.5, 0.8]}
    constant = {"type": "principled", "base_color": color, "roughness": 0.3}
    data = np.broadcast_to([0.2, 0.5, 0.8, 0.3], (4, 8, 4))
    varying = {
        "type": "principled",
        "base_color": field(mi, data, np.zeros((4, 8)), raw=True),
        "roughness": field(mi, data, channel=3),
    }
    expected = sphere_picture(mi, constant)
    np.testing.assert_allclose(sphere_picture(mi, varying), expected, rtol=1e-4, atol=1e-5)
    smoother = varying | {"roughness": field(mi, data, channel=3, scale=0.5)}
    assert np.abs(sphere_picture(mi, smoother) - expected).max() > 0.05 * expected.max()


def feature_scene(mi, texture: dict, antialias: int, size: int = 12):
    """`feature` looking straight down on the whole quad."""
    camera = {
        "type": "orthographic",
        "to_world": mi.ScalarTransform4f().look_at(origin=[0, 0, 3], target=[0, 0, 0], up=[0, 1, 0]),
        "film": {"type": "hdrfilm", "width": size, "height": size},
    }
    integrator = {"type": "feature", "name": "reflectance", "antialias": antialias}
    shape = quad(mi, {"type": "diffuse", "reflectance": texture}, UNIT)
    return mi.load_dict({"type": "scene", "quad": shape, "sensor": camera, "integrator": integrator})


@pytest.mark.parametrize("antialias", [1, 3])
def test_feature_images_all_channels_with_their_adjoint(mi, rng, charts, antialias: int):
    """Through the bridge: picture and gradient equal the averaged slow weights and their transpose."""
    size, n = 12, antialias
    centre = (np.arange(size * n) + 0.5) / (size * n)
    u, v = np.meshgrid(centre, 1 - centre)
    weights = slow_weights((6, 9), np.stack((u, v), axis=-1).reshape(-1, 2), charts)
    weights = weights.reshape(size, n, size, n, 54).mean(axis=(1, 3))
    data = rng.uniform(0, 1, (6, 9, 5))
    world = feature_scene(mi, field(mi, np.zeros((6, 9, 5)), charts), antialias)
    values = torch.from_numpy(data.astype(np.float32)).requires_grad_()
    picture = render(world, values)
    clear = np.abs(weights @ data.reshape(54, 5) - picture.detach().numpy()).max(axis=-1) < 1e-4
    assert clear.mean() > 0.9  # the rest lies on a change of chart, where rounding decides
    upstream = rng.normal(size=(size, size, 5)) * clear[..., None]
    picture.backward(torch.from_numpy(upstream.astype(np.float32)))
    assert values.grad is not None
    expected = np.einsum("hwt,hwc->tc", weights, upstream)
    np.testing.assert_allclose(values.grad.numpy().reshape(54, 5), expected, atol=1e-3)


def test_update_through_traverse(mi, points):
    plugin = field(mi, np.full((4, 4, 3), 0.2), np.zeros((4, 4)), raw=True)
    shape = quad(mi, {"type": "diffuse", "reflectance": plugin}, UNIT)
    np.testing.assert_allclose(radiance(mi, shape, *points), 0.2, atol=1e-6)
    params, key = mi.traverse(shape), "bsdf.reflectance."
    params[key + "data"] = upload(mi.TensorXf, np.full((4, 4, 3), 0.7, np.float32))
    params[key + "scale"] = 0.5
    params.update()
    np.testing.assert_allclose(radiance(mi, shape, *points), 0.35, atol=1e-6)
    chart = np.zeros((4, 4), np.float32)
    chart[:, 2:] = -1
    params[key + "charts"] = mi.TensorXf(chart)
    params.update()
    x, y = points
    far = x > 2 * (2.5 / 4) - 1  # none of the four texels is used
    np.testing.assert_allclose(radiance(mi, shape, x, y)[:, 0], np.where(far, 0, 0.35), atol=1e-6)
    for name, bad in (("data", (4, 12)), ("data", (4, 5, 3)), ("charts", (4, 4, 1))):
        good = mi.TensorXf(params[key + name])
        params[key + name] = upload(mi.TensorXf, np.zeros(bad, np.float32))
        with pytest.raises(ConfigError, match="shape"):
            params.update()
        params[key + name] = good
        params.update()


def test_mean_max_and_resolution(mi, rng):
    data, charts = rng.uniform(0, 0.9, (5, 7, 4)), rng.integers(-1, 3, (5, 7))
    data[charts < 0] = 1
    texture = mi.load_dict(field(mi, data, charts))
    used = srgb_to_linear(data[charts >= 0][:, :3])
    assert texture.mean()[0] == pytest.approx(used.mean(), rel=1e-4)
    assert texture.max() == pytest.approx(used.max(), rel=1e-4)
    plain = mi.load_dict(field(mi, data, raw=True, channel=3))
    assert plain.mean()[0] == pytest.approx(data[..., 3].mean(), rel=1e-5)
    assert list(texture.resolution()) == [7, 5]
    assert texture.is_spatially_varying()


def test_to_string(mi):
    text = str(mi.load_dict(field(mi, np.zeros((7, 5, 2)), channel=1, scale=2.0)))
    start = "TexelField[\n  resolution = [5, 7],\n  channels = 2,\n  filter = bilinear,\n  masked = false,\n"
    assert text.startswith(start + "  channel = 1,\n  scale = [2]") and text.endswith("\n]")


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"chanel": 1}, "chanel"),
        ({"channel": 3}, "use 0 to 2"),
        ({"filter": "cubic"}, "bilinear or nearest"),
        ({"data": None}, "data"),
        ({"data": np.zeros((4, 3))}, "shape"),
        ({"data": np.zeros((4, 0, 3))}, "shape"),
        ({"data": np.full((4, 4, 3), np.nan)}, "not finite"),
        ({"charts": np.zeros((4, 5))}, "'charts' has shape"),
        ({"charts": np.full((4, 4), 0.5)}, "no integers from 0 on"),
        ({"charts": np.full((4, 4), -2)}, "no integers from 0 on"),
        ({"charts": np.full((4, 4), np.nan)}, "no integers from 0 on"),
        ({"charts": np.full((4, 4), -1)}, "no texel"),
    ],
)
def test_bad_properties_are_refused(mi, options: dict, problem: str):
    plugin = field(mi, np.zeros((4, 4, 3)))
    for key, value in options.items():
        plugin[key] = (
            upload(mi.TensorXf, value.astype(np.float32)) if isinstance(value, np.ndarray) else value
        )
    with pytest.raises(RuntimeError, match=problem):
        mi.load_dict({k: v for k, v in plugin.items() if v is not None})


def test_other_variants(mi, points):
    """Registration follows the variant; mono shows luminance, spectral has no colours, scalar is refused."""
    before = mi.variant()
    try:
        mi.set_variant("llvm_ad_mono")
        texture = field(mi, np.full((4, 4, 3), (0.2, 0.5, 0.7)), raw=True)
        value = radiance(mi, quad(mi, {"type": "diffuse", "reflectance": texture}, UNIT), *points)
        np.testing.assert_allclose(value, 0.2 * 0.212671 + 0.5 * 0.715160 + 0.7 * 0.072169, atol=1e-5)
        mi.set_variant("llvm_ad_spectral")
        colour = mi.load_dict(field(mi, np.zeros((4, 4, 3))))
        assert colour.eval_1(at(mi, np.array([(0.2, 0.3)])))[0] == 0
        with pytest.raises(ConfigError, match="texel_field: colours need an rgb or mono"):
            colour.eval(at(mi, np.array([(0.2, 0.3)])))
        mi.set_variant("scalar_rgb")
        with pytest.raises(RuntimeError, match="llvm or cuda"):
            mi.load_dict(field(mi, np.zeros((4, 4, 3))))
    finally:
        mi.set_variant(before)
    assert mi.load_dict(field(mi, np.zeros((4, 4, 3)))).channel_count == 3


def test_maps_of_any_size_share_their_kernel(mi, uv):
    from mitex.runtime.jit import dr

    kernels = []
    si = at(mi, uv)
    for height, width in ((7, 5), (64, 32)):
        texture = mi.load_dict(field(mi, np.ones((height, width, 3))))
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
            dr.kernel_history_clear()
            dr.eval(texture.eval_1_grad(si))
            kernels.append([entry["hash"] for entry in dr.kernel_history()])
    assert kernels[0] == kernels[1] and len(kernels[0]) == 1
