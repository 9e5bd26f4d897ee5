"""Flat pictures on meshes: how large their pixels are there, and what is refused."""

import numpy as np
import pytest

from mitex.colour import linear_to_srgb, srgb_to_linear
from mitex.errors import CheckpointError, ConfigError
from mitex.mesh import icosphere
from mitex.methods.baselines.gatys import GatysTexture
from mitex.methods.baselines.image_quilting import QuiltedPicture
from mitex.methods.layout import with_layout
from mitex.methods.planar import repeated
from tests.methods.surface.grids import flat_square


@pytest.fixture
def picture(rng) -> np.ndarray:
    return rng.uniform(0, 1, (8, 8, 3)).astype(np.float32)


def test_a_pixel_is_a_texel(picture):
    """From the lower left corner on, again and again."""
    expected = np.tile(picture, (3, 3, 1))[-20:, :20]
    np.testing.assert_allclose(repeated(picture, 20, 20), expected, atol=1e-6)


def test_smaller_texels_show_parts_and_larger_ones_mean_light(picture):
    fine, coarse = repeated(picture, 8, 24), repeated(picture, 8, 4)
    np.testing.assert_allclose(fine[1::3, 1::3], picture, atol=1e-6)
    light = srgb_to_linear(picture).reshape(4, 2, 4, 2, 3).mean((1, 3))
    np.testing.assert_allclose(coarse, linear_to_srgb(light), atol=0.02)


def test_sizes_on_a_mesh(picture):
    """A square with UVs that are kept: 8 pixels along its side at size 1, 4 at size 2."""
    texture, square = GatysTexture(picture, 8), flat_square(3)
    asset = texture.apply(square, resolution=16, keep_uvs=True)
    np.testing.assert_allclose(asset.maps["albedo"], repeated(picture, 8, 16), atol=1e-6)
    large = texture.apply(square, scale=2.0, resolution=16, keep_uvs=True)
    np.testing.assert_allclose(large.maps["albedo"], repeated(picture, 4, 16), atol=1e-6)


def test_the_layout_is_that_of_surface_textures(picture):
    ball = icosphere(4)
    asset = GatysTexture(picture, 64).apply(ball, resolution=16)
    laid = with_layout(ball, 64)
    assert asset.atlas is not None and laid.uv is not None and np.array_equal(asset.atlas.uv, laid.uv)


def test_files(picture, tmp_path):
    texture = QuiltedPicture(picture, 8, {"name": "a"})
    path = texture.save(tmp_path / "a.safetensors")
    again = QuiltedPicture.load(path)
    assert np.abs(again.image - picture).max() < 1e-3 and (again.texels, again.about["name"]) == (8, "a")
    with pytest.raises(CheckpointError, match="not a gatys texture"):
        GatysTexture.load(path)


@pytest.mark.parametrize("damage", ["shape", "values", "size"])
def test_damaged_files(damage, picture, tmp_path):
    image = {"shape": picture[:4], "values": picture * np.nan}.get(damage, picture)
    path = GatysTexture(image, 0 if damage == "size" else 8).save(tmp_path / "a.safetensors")
    with pytest.raises(CheckpointError, match="not a gatys texture"):
        GatysTexture.load(path)


@pytest.mark.parametrize("options", [{"scale": 0.01}, {"scale": 21}, {"resolution": 8}, {"resolution": 9000}])
def test_numbers_out_of_range(options, picture):
    with pytest.raises(ConfigError, match=f"`{next(iter(options))}` .* is out of range"):
        GatysTexture(picture, 8).apply(icosphere(4), **options)


def test_uvs_that_cannot_be_kept(picture):
    with pytest.raises(ConfigError, match="no UVs to keep"):
        GatysTexture(picture, 8).apply(icosphere(4), keep_uvs=True)
