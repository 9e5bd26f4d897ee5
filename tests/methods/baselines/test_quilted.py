"""The flat texture of table 2: pictures of patches, quilted."""

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.mesh import grid, icosphere
from mitex.methods.baselines.quilted import in_even_light, quilted_albedo
from mitex.methods.nerf.synthesis.patches import Patches, extract_patches
from mitex.methods.nerf.synthesis.repetition import EVENNESS


def checks(patches: Patches) -> np.ndarray:
    """What a plane of blue and orange waves looks like from above."""
    u, v = (0.5 + 0.5 * np.sin(25.0 * patches.points[..., k]) for k in (0, 1))
    return np.stack([u, 0.5 * (u + v), v], -1)


@pytest.fixture(scope="module")
def patches() -> Patches:
    right = np.array([1.0, 0.0, 0.0])
    rng = np.random.default_rng(1)
    return extract_patches(grid(24, 24), rng, count=400, size=32, pattern_rate=0.15, direction=right)


def test_colours_go_on(patches: Patches):
    """The waves stay in step, to the precision that the patches' places allow."""
    image = quilted_albedo(patches, checks(patches), (130, 170), np.random.default_rng(2))
    assert image.shape == (130, 170, 3) and image.dtype == np.float32
    assert image.min() >= 0.0 and image.max() <= 1.0
    assert np.abs(image[..., 1] - 0.5 * (image[..., 0] + image[..., 2])).max() < 1e-5
    # Red varies along columns only, blue along rows only, and no step is much steeper than the waves.
    steepest = 0.5 * 25.0 * patches.gap
    assert np.abs(np.diff(image, axis=0)).max() < 2.0 * steepest
    assert np.abs(np.diff(image, axis=1)).max() < 2.0 * steepest
    assert image[..., 0].std(0).mean() < 0.5 * image[..., 0].std(1).mean()
    assert image[..., 2].std(1).mean() < 0.5 * image[..., 2].std(0).mean()


def test_tileable(patches: Patches):
    image = quilted_albedo(patches, checks(patches), (96, 64), np.random.default_rng(2), tileable=True)
    for axis in (0, 1):
        steps = np.square(np.diff(image, axis=axis)).mean((1 - axis, 2))
        across = np.square(image.take(0, axis) - image.take(-1, axis)).mean()
        assert across <= steps.max()


def test_same_seed_same_image(patches: Patches):
    a, b = (quilted_albedo(patches, checks(patches), (40, 40), np.random.default_rng(3)) for _ in range(2))
    assert (a == b).all()


def test_what_was_used_is_avoided_as_by_our_own_quilting(patches: Patches):
    """With the same options and seed, the default is the one of features."""
    images = [
        quilted_albedo(patches, checks(patches), (96, 96), np.random.default_rng(3), evenness=evenness)
        for evenness in (None, EVENNESS, 0.0)
    ]
    assert (images[0] == images[1]).all() and (images[0] != images[2]).any()


def test_the_light_is_taken_off_patches_of_all_sides():
    """A ball of one colour under a light from the side: in even light all of its patches are alike."""
    ball = icosphere(24)
    patches = extract_patches(ball, np.random.default_rng(0), count=60, size=16)
    light = np.zeros(16)
    light[0], light[3] = np.sqrt(4 * np.pi), -1.6  # brightest towards +x
    normals = ball.face_normals[patches.faces]
    shades = 1.0 + 1.6 * 2 / 3 * np.sqrt(3 / (4 * np.pi)) * normals[..., 0]
    colour = np.array([0.5, 0.4, 0.3])
    pictures = (shades ** (1 / 2.4))[..., None] * colour
    assert pictures.std((0, 1, 2)).min() > 0.02
    even = in_even_light(patches, pictures, ball, light)
    np.testing.assert_allclose(even, np.broadcast_to(colour, even.shape), rtol=1e-4)


def test_refusals(patches: Patches):
    rng = np.random.default_rng(0)
    with pytest.raises(ConfigError, match="pictures of patches of shape"):
        quilted_albedo(patches, checks(patches)[1:], (40, 40), rng)
    with pytest.raises(ConfigError, match="NaN"):
        quilted_albedo(patches, checks(patches) * np.nan, (40, 40), rng)
