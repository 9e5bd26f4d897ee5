"""Quilts of patches whose right continuation is known. Patches of 32 texels: strips of 12, 20 apart."""

from collections.abc import Iterable
from typing import Any

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.quilting.guide import Guide
from mitex.quilting.matching import SIDES, ArraySource, Matcher, mirror, overlap, strip
from mitex.quilting.plane import Quilt, quilt
from tests.quilting.sources import SIDE, continued, crop_source, crops, every, noise_source, periodic_image

STRIDE = 20


def test_one_source_is_put_together_again(rng: np.random.Generator):
    """Where every crop of a periodic image is there, the best quilt is that image, without a flaw."""
    image, corners = periodic_image(), every(4)
    texture = quilt(crop_source(image, corners), (105, 90), rng, nearest=1)
    expected = continued(image, corners[texture.patch[0, 0]], (105, 90))
    assert np.abs(texture.features - expected).max() < 1e-5
    assert (texture.look_up(crops(image, corners)) == expected).all()
    assert len(np.unique(texture.patch)) > 10


def test_mirrored_patches_are_turned_back(rng: np.random.Generator):
    """Half of the crops are stored mirrored; the quilt is still the image, mirrored as its first patch is."""
    image, corners = periodic_image(), every(4)
    stored = rng.integers(0, 4, len(corners))
    values = np.stack([mirror(v, f) for v, f in zip(crops(image, corners), stored, strict=True)])
    texture = quilt(ArraySource(values, corners.astype(float), 32.0), (72, 93), rng, flips=True, nearest=1)
    first = texture.patch[0, 0]
    total = int(stored[first] ^ texture.flip[0, 0])
    mirror_image = mirror(image, total)  # of which the first patch is a crop at
    down, right = corners[first]
    corner = np.array([32 - down if total & 2 else down, 32 - right if total & 1 else right])
    expected = continued(mirror_image, corner % 64, (72, 93))
    assert np.abs(texture.features - expected).max() < 1e-5
    assert (texture.look_up(values) == expected).all()
    assert (np.unique(stored[texture.patch] ^ texture.flip) == total).all()
    assert len(np.unique(texture.flip)) == 4


def test_stripes_go_on(rng: np.random.Generator):
    """Vertical stripes of any phase, as published: rows stay alike, and the wavelength is kept."""
    phase = rng.random(300)
    x = np.arange(SIDE) / 10.0
    waves = np.sin(2.0 * np.pi * (x + phase[:, None]))
    values = np.broadcast_to(waves[:, None, :, None], (300, SIDE, SIDE, 1)).astype(np.float32)
    source = ArraySource(values, rng.random((300, 2)) * 1000.0, float(SIDE))
    image = quilt(source, (112, 192), rng, evenness=0.0).features[..., 0]
    assert image.std(axis=0).max() < 0.2
    spectrum = np.abs(np.fft.rfft(image.mean(0)[:190]))
    assert spectrum[1:].argmax() + 1 == 19
    seams = np.abs(np.diff(image, axis=1)).max()
    assert seams < 1.3 * 2.0 * np.pi / 10.0  # no step is steeper than the waves by much


def places(texture: Quilt, tileable: bool = False) -> np.ndarray:
    """(rows, columns) which patches lie there, by the middle of their cores."""
    size = texture.patch.shape
    if tileable:
        counts = [-(-length // STRIDE) for length in size]
        corners = [np.round(np.linspace(0, n - STRIDE, k)) for n, k in zip(size, counts, strict=True)]
    else:
        corners = [np.arange(0, max(length - 12, 1), STRIDE) for length in size]
    middle = [corner.astype(int) + SIDE // 2 for corner in corners]
    return texture.patch[np.ix_(*(m[m < length] for m, length in zip(middle, size, strict=True)))]


@pytest.mark.parametrize("tileable", [False, True])
@pytest.mark.parametrize("flips", [False, True])
def test_neighbours_are_from_elsewhere(tileable: bool, flips: bool, rng: np.random.Generator):
    """Every patch has a twin nearby, which would continue it best."""
    base = noise_source(30)
    smooth = base.values.mean((1, 2), keepdims=True) * 10.0 + 0.0 * base.values  # constant: fits itself best
    values = np.concatenate([smooth, smooth])
    centres = np.concatenate([base.centres, base.centres + 0.1 * SIDE])
    texture = quilt(
        ArraySource(values, centres, float(SIDE)), (192, 152), rng, flips=flips, tileable=tileable
    )
    grid = centres[places(texture, tileable)]
    pairs = [grid[1:] - grid[:-1], grid[:, 1:] - grid[:, :-1]]
    if tileable:
        pairs += [grid[:1] - grid[-1:], grid[:, :1] - grid[:, -1:]]
    assert len(grid) >= 9
    assert min(np.linalg.norm(pair, axis=-1).min() for pair in pairs) >= 0.2 * SIDE


def test_few_patches_repeat_as_little_as_they_can(rng: np.random.Generator):
    two = ArraySource(noise_source(2).values, np.zeros((2, 3)), 1.0)
    patches = places(quilt(two, (92, 92), rng))
    assert (patches[1:] != patches[:-1]).all() and (patches[:, 1:] != patches[:, :-1]).all()
    one = ArraySource(noise_source(1).values, np.zeros((1, 3)), 1.0)
    assert (quilt(one, (70, 40), rng).patch == 0).all()


def test_exclusion_is_by_distance_of_sources():
    centres = np.array([[0.0, 0.0], [0.19 * SIDE, 0.0], [0.21 * SIDE, 0.0], [SIDE, 0.0]])
    matcher = Matcher(ArraySource(noise_source(4).values, centres, float(SIDE)), (0,), ("left",))
    assert matcher.allowed([]).tolist() == [True, True, True, True]
    assert matcher.allowed([0]).tolist() == [False, False, True, True]
    assert matcher.allowed([0, 2]).tolist() == [False, False, False, True]
    # None is far from all: others than the neighbours are left.
    assert matcher.allowed([0, 2, 3]).tolist() == [False, True, False, False]


def summed_blocks(values: np.ndarray, axis: int) -> np.ndarray:
    parts = np.split(values, range(4, values.shape[axis], 4), axis)
    return np.stack([part.sum(axis, dtype=np.float64) for part in parts])


def test_distances_are_those_of_the_strips(rng: np.random.Generator):
    """Against the definition, for all sides and mirror images; only the first channels count."""
    source = ArraySource(noise_source(5).values, np.zeros((5, 2)), 1.0, channels=2)
    targets: Any = {side: strip(rng.normal(size=(SIDE, SIDE, 2)), side) for side in SIDES}
    assert overlap(SIDE) == 12
    assert targets["left"].shape == (32, 12, 2) and targets["top"].shape == (12, 32, 2)
    for sides in (("left",), ("left", "top"), SIDES):
        distances = Matcher(source, (0, 1, 2, 3), sides).distances({side: targets[side] for side in sides})
        for flip in range(4):
            for index in range(5):
                square = mirror(source.values[index], flip)[..., :2]
                total = 0.0
                for side in sides:
                    part = {
                        "left": square[:, :12],
                        "right": square[:, 20:],
                        "top": square[:12],
                        "bottom": square[20:],
                    }[side]
                    axis = 0 if side in ("left", "right") else 1
                    total += np.square(summed_blocks(part - targets[side], axis)).sum()
                assert distances[flip, index] == pytest.approx(np.sqrt(total), rel=1e-4)


def test_chances_fall_with_the_cube(rng: np.random.Generator):
    matcher = Matcher(noise_source(8), (0,), ("left",))
    costs = np.array([[4.0, 0.0, 9.0, 1.0, 2.0, 3.0, 8.0, 7.0]])
    everyone = np.ones(8, bool)
    choices = [matcher.choose(costs, everyone, rng, 5)[0] for _ in range(6000)]
    weights = np.array([0.0, 1.0, 0.0, 0.75**3, 0.5**3, 0.25**3, 0.0, 0.0])
    assert np.bincount(choices, minlength=8) / 6000 == pytest.approx(weights / weights.sum(), abs=0.02)
    # Four are looked at until one is allowed.
    allowed = np.zeros(8, bool)
    allowed[[7, 2]] = True
    assert {matcher.choose(costs, allowed, rng, 2)[0] for _ in range(50)} == {7}


def test_seeds(rng: np.random.Generator):
    source = noise_source()
    a, b, c = (quilt(source, (80, 80), np.random.default_rng(seed), flips=True) for seed in (7, 7, 8))
    for name in ("features", "patch", "flip", "texel"):
        assert (getattr(a, name) == getattr(b, name)).all()
    assert (a.patch != c.patch).mean() > 0.5
    firsts = {int(quilt(source, (8, 8), np.random.default_rng(seed)).patch[0, 0]) for seed in range(40)}
    assert len(firsts) > 20  # the first is any of 60, not one of the 16 nearest to nothing


@pytest.mark.parametrize("size", [(1, 1), (12, 33), (32, 32), (33, 32), (71, 52)])
def test_any_size(size: tuple[int, int], rng: np.random.Generator):
    texture = quilt(noise_source(), size, rng)
    assert texture.features.shape == (*size, 3) and texture.features.dtype == np.float32
    assert texture.patch.shape == texture.flip.shape == size
    assert texture.texel.shape == (*size, 2)
    assert not texture.flip.any()


@pytest.mark.parametrize("tileable", [False, True])
def test_one_mask_serves_all_maps(tileable: bool, rng: np.random.Generator):
    """Away from seams, features are the very texels that the maps name; at seams, a mean of two."""
    source = noise_source()
    texture = quilt(source, (112, 95), rng, flips=True, tileable=tileable)
    named = texture.look_up(source.values)
    mode: Any = "wrap" if tileable else "edge"
    around = np.lib.stride_tricks.sliding_window_view(np.pad(texture.patch, 4, mode=mode), (9, 9))
    quiet = (around == texture.patch[..., None, None]).all((2, 3))
    assert 0.1 < quiet.mean() < 0.8
    assert np.abs(texture.features - named)[quiet].max() < 1e-5
    assert np.abs(texture.features - named)[~quiet].max() > 0.1


def broken(values: Iterable[tuple[Any, Any]]) -> ArraySource:
    source = noise_source(4)
    for place, value in values:
        source.values[place] = value
    return source


def test_refusals(rng: np.random.Generator):
    good = noise_source(4)
    squares = good.values
    options: list[tuple[ArraySource, tuple[int, int], dict[str, Any], str]] = [
        (good, (0, 5), {}, "texture of"),
        (good, (5, 5), {"nearest": 0}, "candidates"),
        (good, (31, 64), {"tileable": True}, "use at least 32"),
        (ArraySource(squares[:0], np.zeros((0, 2)), 1.0), (5, 5), {}, "no patches"),
        (ArraySource(squares[:, :30, :30], good.centres, 1.0), (5, 5), {}, "multiple of 8"),
        (ArraySource(squares[:, :24], good.centres, 1.0), (5, 5), {}, "multiple of 8"),
        (ArraySource(squares, good.centres, 1.0, 0), (5, 5), {}, "0 of 3 channels"),
        (ArraySource(squares, good.centres, 1.0, 4), (5, 5), {}, "4 of 3 channels"),
        (broken([((2, 20, 5, 1), np.nan)]), (5, 5), {}, "NaN or infinite"),
        (good, (5, 5), {"guide": Guide(np.zeros((4, 4, 3)), np.zeros((3, 2, 2, 3)))}, "all 4"),
        (good, (5, 5), {"guide": Guide(np.zeros((4, 4, 3)), np.zeros((4, 5, 5, 3)))}, "divides 32"),
    ]
    for source, size, wrong, message in options:
        with pytest.raises(ConfigError, match=message):
            quilt(source, size, rng, **wrong)
