"""texel_field: what it says of itself, what it refuses, and variants."""

import numpy as np
import pytest

from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError
from mitex.runtime.upload import upload
from tests.textures.helpers import quad, radiance
from tests.textures.texels import UNIT, at, field


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
