"""texel_field: lookups against a slow reference, charts that do not bleed, gradients, `feature`."""

from typing import Any

import numpy as np
import pytest
import torch

from mitex.bridge import render
from mitex.runtime.upload import upload
from tests.textures.helpers import quad
from tests.textures.texels import UNIT, at, field, lookups, slow_weights


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
