"""What was used before is avoided: counts by hand, and quilts that would repeat themselves."""

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.quilting.guide import Guide
from mitex.quilting.matching import ArraySource
from mitex.quilting.plane import Quilt, quilt
from mitex.quilting.repetition import REACH, Repetition

SIDE, STRIDE = 32, 20


def test_counts_fall_with_the_distance_of_sources():
    repetition = Repetition(np.array([[0.0, 0.0], [3.0, 0.0], [0.0, 100.0]]), 10.0, 0.5)
    assert repetition.penalties().tolist() == [0.0, 0.0, 0.0]
    repetition.add(0)
    repetition.add(0)
    repetition.add(2)
    near = np.exp(-0.5 * (3.0 / (REACH * 10.0)) ** 2)
    assert repetition.penalties() == pytest.approx([1.0, near, 0.5])


def test_none_is_preferred_without_evenness():
    repetition = Repetition(np.zeros((4, 3)), 1.0, 0.0)
    repetition.add(1)
    assert repetition.penalties().tolist() == [0.0] * 4


@pytest.mark.parametrize("evenness", [-0.1, np.nan, np.inf])
def test_refusals(evenness: float):
    with pytest.raises(ConfigError, match="evenness"):
        Repetition(np.zeros((4, 3)), 1.0, evenness)


def two_kinds(rng: np.random.Generator) -> ArraySource:
    """200 patches, of which every tenth is bright; each has the level of its kind, and fits that best."""
    level = np.where(np.arange(200) % 10 == 0, 1.0, 0.0) + rng.normal(size=200) * 0.3
    values = np.broadcast_to(level[:, None, None, None], (200, SIDE, SIDE, 1)).astype(np.float32)
    return ArraySource(values, rng.random((200, 2)) * 20.0 * SIDE, float(SIDE))


def uses(texture: Quilt) -> np.ndarray:
    """(200,) how often each patch is in a quilt, by the middle of its core."""
    return np.bincount(texture.patch[SIDE // 2 :: STRIDE, SIDE // 2 :: STRIDE].ravel(), minlength=200)


def test_rare_patches_are_there_and_none_is_all_over(rng: np.random.Generator):
    """Out of 400 places, a tenth should be bright; as published, some patch is there dozens of times."""
    source = two_kinds(rng)
    size = 20 * STRIDE + 12, 20 * STRIDE + 12
    even, plain = (uses(quilt(source, size, np.random.default_rng(3), evenness=e)) for e in (0.1, 0.0))
    assert even.sum() == plain.sum() == 400
    bright = slice(None, None, 10)
    assert even.max() <= 6 and plain.max() > 2 * even.max()
    assert abs(even[bright].sum() - 40) < abs(plain[bright].sum() - 40)
    assert (even == 0).sum() < (plain == 0).sum() / 2


def test_what_a_guide_asks_for_is_not_avoided(rng: np.random.Generator):
    """It wants those all over that are a little brighter, 20 for 400 places: by default, they are there."""
    source = two_kinds(rng)
    bright = np.arange(200) % 10 == 0
    colours = np.broadcast_to(0.2 * bright[:, None, None, None], (200, 2, 2, 3))
    guide = Guide(np.full((4, 4, 3), 0.2), colours)
    size = 20 * STRIDE + 12, 20 * STRIDE + 12
    default_uses, even_uses = (
        uses(quilt(source, size, np.random.default_rng(3), guide=guide, evenness=e)) for e in (None, 0.1)
    )
    assert default_uses[bright].sum() >= 390 and even_uses[bright].sum() < 360
