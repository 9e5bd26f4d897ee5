"""texel_field in BSDFs: reflectance, bumps, normal maps, and updates of what is shown."""

import numpy as np
import pytest

from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError
from mitex.runtime.upload import upload
from tests.textures.helpers import (
    BUMPS,
    LIGHT,
    NORMAL,
    NORMALS,
    SLOPE,
    grey_radiance,
    quad,
    radiance,
    sphere_picture,
)
from tests.textures.texels import UNIT, field


def ramp(slope: np.ndarray, side: int = 64) -> np.ndarray:
    """(N, N, 1) slope . (x, y) on the quad of the tests, where u = (x + 1) / 2."""
    centre = (np.arange(side) + 0.5) / side * 2 - 1
    return (slope[0] * centre[None, :] - slope[1] * centre[:, None])[..., None]


def test_reflectance_decodes_srgb(mi, points):
    x, y = (0.95 * p for p in points)
    data = 0.5 + 0.7 * ramp(np.array((0.4, 0.8))) * np.array([1, -1, 0.5])  # leaves [0, 1] at the rim
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


def test_bump_of_a_linear_height_tilts_the_normal(mi, points):
    bsdf = BUMPS | {"height": field(mi, ramp(SLOPE))}
    expected = grey_radiance(np.array([*-SLOPE, 1]))
    result = radiance(mi, quad(mi, bsdf, UNIT), *points, light=tuple(LIGHT))
    np.testing.assert_allclose(result, expected, atol=1e-4)
    assert abs(expected - 0.6 * -LIGHT[2]) > 0.05


def test_normal_map_tilts_the_normal(mi, points):
    bsdf = NORMALS | {"normalmap": field(mi, np.broadcast_to(0.5 * (NORMAL + 1), (2, 2, 3)))}
    result = radiance(mi, quad(mi, bsdf, UNIT), *points, light=tuple(LIGHT))
    np.testing.assert_allclose(result, grey_radiance(NORMAL), atol=1e-5)


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
