"""EXR: names, values and precision of the channels."""

from typing import Any

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.colour import srgb_to_linear
from mitex.errors import ConfigError, OutputError
from mitex.export import write_exr, write_textures, write_views
from mitex.mesh import icosphere
from tests.export.common import read_exr, wavy

ALL = {"albedo.R", "albedo.G", "albedo.B", "ambient_occlusion.Y", "height.Y", "roughness.Y"} | {
    f"normal.{c}" for c in "XYZ"
}


@pytest.fixture(scope="module")
def baked() -> Any:
    return wavy(icosphere(4)).baked(resolution=64)


@pytest.mark.parametrize("half", [True, False])
def test_textures_come_back_by_name(half, baked, tmp_path):
    write_textures(baked, tmp_path / "a.exr", half=half)
    channels = read_exr(tmp_path / "a.exr")
    assert set(channels) == ALL
    assert {v.dtype for v in channels.values()} == {np.dtype(np.float16 if half else np.float32)}
    tolerance = 1e-3 if half else 0
    maps = baked.texture_maps
    np.testing.assert_allclose(channels["normal.Y"], maps["normal"][..., 1], atol=tolerance)
    np.testing.assert_allclose(channels["height.Y"], maps["height"][..., 0], atol=tolerance)
    np.testing.assert_allclose(channels["albedo.G"], srgb_to_linear(maps["albedo"])[..., 1], atol=tolerance)


def test_export_writes_float16_and_bakes_first(baked, tmp_path, monkeypatch):
    monkeypatch.setattr(Asset, "baked", lambda self: baked)
    assert set(read_exr(wavy(icosphere(4)).export(tmp_path / "a.exr"))) == ALL


def test_views_are_layers(tmp_path, rng):
    images = rng.random((2, 8, 6, 5)).astype(np.float32)
    channels = read_exr(
        write_views(tmp_path / "v.exr", images, ["height", "albedo", "roughness"], half=False)
    )
    assert len(channels) == 10
    np.testing.assert_array_equal(channels["view1.height.Y"], images[1, ..., 0])
    np.testing.assert_array_equal(channels["view0.roughness.Y"], images[0, ..., 4])
    np.testing.assert_array_equal(channels["view1.albedo.B"], srgb_to_linear(images[1, ..., 3]))


def test_values_beyond_float16_are_clipped(tmp_path):
    image = np.array([[1e9, -1e9, 0.5]], np.float32)
    red = read_exr(write_exr(tmp_path / "a.exr", {"R": image}))["R"]
    np.testing.assert_array_equal(red, [[65504, -65504, 0.5]])


def test_wrong_input(tmp_path):
    with pytest.raises(ConfigError, match="one size"):
        write_exr(tmp_path / "a.exr", {"R": np.zeros((2, 2)), "G": np.zeros((2, 3))})
    with pytest.raises(ConfigError, match="one size"):
        write_exr(tmp_path / "a.exr", {})
    with pytest.raises(ConfigError, match="do not name"):
        write_views(tmp_path / "a.exr", np.zeros((1, 2, 2, 4)), ["albedo"])
    with pytest.raises(ConfigError, match="do not name"):
        write_views(tmp_path / "a.exr", np.zeros((1, 2, 2, 3)), ["colour"])
    with pytest.raises(OutputError):
        write_exr(tmp_path / "a.png", {"R": np.zeros((2, 2))})
    assert not list(tmp_path.iterdir())
