"""Quilted pictures: errors against a slow sum, blocks that go on, and the choice among the best."""

import tomllib

import numpy as np
import pytest
from PIL import Image

from mitex.errors import ConfigError, ImageError
from mitex.exemplar import Exemplar
from mitex.methods.baselines import image_quilting
from mitex.methods.baselines.image_quilting import QuiltedPicture
from mitex.methods.baselines.image_quilting.quilting import OverlapErrors, draw, quilt


@pytest.fixture
def exemplar(rng) -> np.ndarray:
    return rng.uniform(0, 1, (30, 25, 3)).astype(np.float32)


@pytest.mark.parametrize("sides", [(True, False), (False, True), (True, True)])
def test_errors_equal_a_slow_sum(sides, exemplar, rng):
    block, overlap = 12, 3
    old = rng.uniform(0, 1, (block, block, 3)).astype(np.float32)
    actual = OverlapErrors(exemplar, block, overlap)(old, *sides)
    mask = np.zeros((block, block), bool)
    mask[:, :overlap] |= sides[0]
    mask[:overlap] |= sides[1]
    for row in range(30 - block + 1):
        for column in range(25 - block + 1):
            new = exemplar[row : row + block, column : column + block]
            assert actual[row, column] == pytest.approx(np.square(new - old)[mask].sum(), abs=1e-4)
    assert actual.shape == (19, 14)


def test_the_first_block_may_be_any(exemplar):
    errors = OverlapErrors(exemplar, 12, 3)(np.zeros((12, 12, 3), np.float32), False, False)
    assert np.ptp(errors) == 0
    drawn = {draw(errors, 0.1, np.random.default_rng(seed)) for seed in range(200)}
    assert len(drawn) > 100


def test_only_the_best_are_drawn():
    errors = np.array([[1.0, 1.05, 1.2], [1.1, 3.0, 1.0]])
    drawn = {draw(errors, 0.1, np.random.default_rng(seed)) for seed in range(60)}
    assert drawn == {(0, 0), (0, 1), (1, 0), (1, 2)}
    assert {draw(errors, 0.0, np.random.default_rng(seed)) for seed in range(20)} == {(0, 0), (1, 2)}


def test_a_pattern_that_repeats_goes_on():
    """Every block continues the one before exactly, since the exemplar has all the phases."""
    x = np.arange(48)
    wave = 0.5 + 0.5 * np.sin(2 * np.pi * x / 8)
    exemplar = np.stack([np.tile(wave, (48, 1)), np.tile(wave[:, None], (1, 48))], axis=2).astype(np.float32)
    picture = quilt(exemplar, 70, 24, 4, np.random.default_rng(0))
    assert picture.shape == (70, 70, 2)
    np.testing.assert_allclose(picture[8:], picture[:-8], atol=1e-5)
    np.testing.assert_allclose(picture[:, 8:], picture[:, :-8], atol=1e-5)


def test_every_pixel_is_from_the_exemplar_unless_cuts_are_soft(exemplar):
    pixels = {tuple(pixel) for pixel in exemplar.reshape(-1, 3)}
    hard = quilt(exemplar, 40, 12, 3, np.random.default_rng(1))
    assert {tuple(pixel) for pixel in hard.reshape(-1, 3)} <= pixels
    soft = quilt(exemplar, 40, 12, 3, np.random.default_rng(1), soft=True)
    mixed = [tuple(pixel) not in pixels for pixel in soft.reshape(-1, 3)]
    assert 0.1 < np.mean(mixed) < 0.9


def test_settings_reach_the_picture(tmp_path):
    lava = Exemplar.load("lava")
    small = {"size": 48, "exemplar_size": 32, "block": 12, "resolution": 100}
    texture = image_quilting.fit(lava, tmp_path / "run", set=small)
    assert texture.image.shape == (48, 48, 3) and texture.texels == 100
    assert np.abs(QuiltedPicture.load(tmp_path / "run").image - texture.image).max() < 1e-3
    for setting in ("block=18", "tolerance=2", "soft=false", "seed=1", "exemplar_size=40"):
        words = [f"{key}={value}" for key, value in small.items() if not setting.startswith(key)]
        assert not np.array_equal(image_quilting.fit(lava, set=[*words, setting]).image, texture.image)
    assert image_quilting.PRESETS["paper"].soft is False


def test_a_file_name_that_is_no_utf_8_is_escaped(tmp_path):
    """Whether the exemplar is a file or a folder; what is written down can be read."""
    picture = (np.random.default_rng(0).random((40, 40, 3)) * 255).astype(np.uint8)
    file, folder = tmp_path / "\udcff.png", tmp_path / "\udcfe"
    folder.mkdir()
    for path in (file, folder / "albedo.png"):
        Image.fromarray(picture).save(path)
    for path, name in ((file, "\\udcff"), (folder, "\\udcfe")):
        run = tmp_path / f"run {name}"
        image_quilting.fit(path, run, set={"size": 48, "exemplar_size": 32, "block": 12})
        content = tomllib.loads((run / "config.toml").read_text(encoding="utf-8"))
        assert content["run"]["exemplar"] == name and QuiltedPicture.load(run).image.shape == (48, 48, 3)


def test_what_is_refused():
    lava = Exemplar.load("lava")
    with pytest.raises(ConfigError, match="blocks of 100 pixels; use up to 64"):
        image_quilting.fit(lava, set=["block=100", "exemplar_size=64"])
    with pytest.raises(ImageError, match="has no albedo"):
        image_quilting.fit(Exemplar({"height": np.zeros((32, 32, 1), np.float32)}))
