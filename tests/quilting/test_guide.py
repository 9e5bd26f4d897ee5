"""Guides: what a picture asks for is where it asks for it."""

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.quilting.guide import Guide, GuideDistance
from mitex.quilting.matching import ArraySource, mirror
from mitex.quilting.plane import quilt
from tests.quilting.sources import SIDE, noise_source


def bright_source(rng: np.random.Generator) -> tuple[ArraySource, np.ndarray]:
    """Patches of noise, with a brightness each that is not compared, and their colours."""
    base = noise_source(200, 2)
    base.values[..., 1] = rng.random(200)[:, None, None]
    source = ArraySource(base.values, base.centres, base.length, channels=1)
    return source, np.broadcast_to(base.values[:, :1, :1, 1:], (200, 2, 2, 3))


def test_guide_decides_what_is_where(rng: np.random.Generator):
    source, colours = bright_source(rng)
    picture = np.zeros((20, 30, 3))
    picture[:, 15:] = 1.0
    image = quilt(source, (112, 172), rng, guide=Guide(picture, colours, weight=20.0)).features[..., 1]
    assert image[:, :70].mean() < 0.2 and image[:, 102:].mean() > 0.8
    ignored = quilt(source, (112, 172), rng, guide=Guide(picture, colours, weight=0.0)).features[..., 1]
    assert ignored[:, :70].mean() > 0.35


@pytest.mark.parametrize("level", [0.0, 1.0])
def test_guide_chooses_the_first_patch_too(level: float, rng: np.random.Generator):
    source, colours = bright_source(rng)
    guide = Guide(np.full((4, 4, 3), level), colours)
    values = [quilt(source, (32, 32), rng, guide=guide).features[0, 0, 1] for _ in range(10)]
    assert np.abs(np.array(values) - level).max() < 0.15


def test_guide_turns_patches(rng: np.random.Generator):
    """All are dark on their left and bright below; the guide wants it the other way round."""
    source = noise_source(20)
    colours = np.zeros((20, 2, 2, 3))
    colours[:, 0, 1], colours[:, 1, 0], colours[:, 1, 1] = 0.3, 0.5, 0.8
    picture = mirror(colours[0], 3).repeat(16, 0).repeat(16, 1)
    texture = quilt(source, (32, 32), rng, flips=True, guide=Guide(picture, colours), nearest=1)
    assert (texture.flip == 3).all()


def test_likeness_is_the_root_mean_square(rng: np.random.Generator):
    colours, picture = rng.random((3, 4, 4, 3)), rng.random((50, 50, 3))
    likeness = GuideDistance(Guide(picture, colours, 2.0), 3, (50, 50), SIDE, wrapped=True)
    differences = likeness.differences(40, 10, (0, 1, 2, 3))
    below = np.tile(picture, (2, 2, 1))[40:72, 10:42].reshape(4, 8, 4, 8, 3).mean((1, 3))
    for flip in range(4):
        patches = np.stack([mirror(c, flip) for c in colours])
        expected = 2.0 * np.sqrt(np.square(patches - below).mean((1, 2, 3)))
        assert differences[flip] == pytest.approx(expected, rel=1e-5)


def test_guide_refusals():
    picture, colours = np.zeros((4, 4, 3)), np.zeros((3, 2, 2, 3))
    guides: list[tuple[np.ndarray, np.ndarray, float]] = [
        (picture[..., :2], colours, 1.0),
        (picture[:0], colours, 1.0),
        (picture + np.nan, colours, 1.0),
        (picture, colours[:, :1], 1.0),
        (picture, colours + np.inf, 1.0),
        (picture, colours, -1.0),
        (picture, colours, np.nan),
    ]
    for wrong in guides:
        with pytest.raises(ConfigError):
            Guide(*wrong)
