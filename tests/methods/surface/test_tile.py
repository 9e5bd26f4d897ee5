"""Flat tiles: levels that go on at the opposite side, and a synthesis that repeats."""

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.methods import surface
from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.network import SurfaceVgg
from mitex.methods.surface.texture import SurfaceTexture
from mitex.methods.surface.tile import TileDomain, tile_levels
from mitex.training import resolve
from tests.methods.surface.grids import grid_levels

pytestmark = pytest.mark.usefixtures("own_cache")
SIDE, DEPTH = 64, 5


def test_levels_are_those_of_a_grid_but_at_the_sides():
    tile, grid = tile_levels(SIDE, DEPTH), grid_levels(SIDE)
    assert np.array_equal(tile.order, grid.order)
    for n, (ours, theirs) in enumerate(zip(tile.levels, grid.levels, strict=True)):
        width = SIDE >> n
        row, column = np.divmod(tile.order[:: 4**n], SIDE)
        row, column = row >> n, column >> n
        inner = (np.minimum(row, column) > 0) & (np.maximum(row, column) < width - 1)
        assert inner.sum() == max(width - 2, 0) ** 2
        assert np.array_equal(ours.taps[inner], theirs.taps[inner])
        assert np.array_equal(ours.sizes, theirs.sizes)
        place = np.stack([row, column], 1)
        for tap, offset in enumerate(np.ndindex(3, 3)):
            expected = (place + np.array(offset) - 1) % width
            assert np.array_equal(place[ours.taps[:, tap]], expected)


def test_positions_and_texels_belong_together():
    domain = TileDomain.flat(resolve(PRESETS, None, None, ["resolution=64", "scales=0"]))
    levels, texels = domain.levels, domain.texels
    assert len(texels.index) == SIDE**2 and texels.inside.all()
    assert np.allclose(levels.position, texels.position[levels.order], atol=1e-6)
    values = np.arange(SIDE**2, dtype=np.float32)[:, None]
    assert np.array_equal(levels.spread @ values[levels.order], values)
    right, up = domain.tangent_frames
    assert np.allclose(right, [1, 0, 0]) and np.allclose(up, [0, 1, 0])


def test_features_do_not_know_where_the_sides_are():
    """Shifted by half the tile, which all poolings allow, the features are shifted, too."""
    levels = tile_levels(SIDE, DEPTH)
    network = SurfaceVgg(levels, precision="float32")
    image = torch.rand(SIDE, SIDE, 3, generator=torch.Generator().manual_seed(0))

    def features(image, layer, n):
        vectors = network.features(image.reshape(-1, 3)[levels.order], [layer])[layer]
        row, column = np.divmod(levels.order[:: 4**n], SIDE)
        out = torch.empty(SIDE >> n, SIDE >> n, vectors.shape[1])
        out[row >> n, column >> n] = vectors
        return out

    for layer, n in (("relu1_1", 0), ("relu3_1", 2), ("relu5_1", 4)):
        one = features(image, layer, n)
        other = features(image.roll((32, 32), (0, 1)), layer, n)
        shift = 32 >> n
        assert torch.allclose(
            one.roll((shift, shift), (0, 1)), other, rtol=1e-3, atol=1e-2 * float(one.max())
        )
        assert one.std() > 0


def test_a_tile_is_synthesized_saved_and_applied(tmp_path):
    exemplar = Exemplar.load("cobblestone").resized(64)
    exemplar = Exemplar({name: exemplar.maps[name] for name in ("albedo", "normal")}, "stones")
    settings = ["resolution=64", "exemplar_size=64", "steps=3", "scales=1", "preview_every=2"]
    layers = "layers=relu1_1,relu2_1"
    texture = surface.fit(exemplar, None, tmp_path / "run", set=[*settings, layers])
    assert list((tmp_path / "run" / "previews").iterdir())
    asset = SurfaceTexture.load(tmp_path / "run").apply()
    assert asset.texture_maps is not None and asset.texture_maps["albedo"].shape == (64, 64, 3)
    pixels = texture.values.reshape(64, 64, -1)
    assert np.abs(asset.texture_maps["albedo"] - pixels[..., :3]).max() < 1e-3
    # The square's own frame is the image's: only the length of the normals changes.
    normal, image = 2 * pixels[..., 3:] - 1, 2 * asset.texture_maps["normal"] - 1
    normal[..., 2] = np.maximum(normal[..., 2], 0.06 * np.linalg.norm(normal, axis=2))
    angle = (normal * image).sum(2) / np.linalg.norm(normal, axis=2) / np.linalg.norm(image, axis=2)
    assert angle.min() > 0.99


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        (["resolution=100", "scales=0"], "100 texels cannot be halved 5 times; use a multiple of 32"),
        (["resolution=64", "scales=2"], "64 texels cannot be halved 7 times; use a multiple of 128"),
        (["resolution=64", "scales=0", "angle=30"], "angle = 30 of a tile"),
    ],
)
def test_settings_that_do_not_fit(settings, problem):
    with pytest.raises(ConfigError, match=problem):
        TileDomain.flat(resolve(PRESETS, None, None, settings))


@pytest.mark.parametrize("option", [{"keep_uvs": True}, {"content": "ao"}, {"orientation": np.zeros((4, 3))}])
def test_options_of_meshes_are_refused(option, tmp_path):
    with pytest.raises(ConfigError, match="a tile takes no"):
        surface.fit("lava", None, tmp_path / "run", set=["resolution=128"], **option)
    assert not (tmp_path / "run").exists()
