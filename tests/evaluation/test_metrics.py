"""Distances of pictures: closed forms, slow references, and what they must agree with."""

import math
import sys

import numpy as np
import pytest
import scipy.linalg
import torch
from scipy.ndimage import gaussian_filter

from mitex.errors import ConfigError, ImageError, MissingPackage
from mitex.evaluation import metrics
from mitex.evaluation.metrics import gaussian_frechet, psnr, single_image_frechet, ssim, vgg_distance
from mitex.exemplar import Exemplar, names
from mitex.features import Vgg16

PAIRED = [psnr, ssim, vgg_distance]
ALL = [*PAIRED, single_image_frechet]
SIZE = 64


@pytest.fixture(scope="module")
def picture():
    return np.asarray(Exemplar.load(names()[0]).resized(SIZE).maps["albedo"], np.float32)


@pytest.fixture(scope="module")
def another():
    return np.asarray(Exemplar.load(names()[1]).resized(SIZE).maps["albedo"], np.float32)


def _blurred(image, sigma):
    return gaussian_filter(image, (sigma, sigma, 0))


def _noisy(image, strength):
    noise = np.random.default_rng(1).normal(size=image.shape)
    return (image + strength * noise).clip(0, 1).astype(np.float32)


def _left(image):
    mask = np.zeros(image.shape[:2], bool)
    mask[:, : image.shape[1] // 2] = True
    return mask


def test_psnr_of_an_even_difference_is_in_closed_form():
    a = np.full((4, 5, 3), 0.5, np.float32)
    assert psnr(a, a + 0.1) == pytest.approx(20, abs=1e-5)
    b = a.copy()
    b[0, 0, 0] += 0.5  # one value of 60
    assert psnr(a, b) == pytest.approx(10 * math.log10(60 / 0.25), abs=1e-5)
    assert psnr(a, a) == math.inf


def test_psnr_of_a_mask_is_that_of_its_pixels(picture, another):
    mask = _left(picture)
    inside = psnr(picture[:, : SIZE // 2], another[:, : SIZE // 2])
    assert psnr(picture, another, mask) == pytest.approx(inside)
    changed = another.copy()
    changed[~mask] = 0
    assert psnr(picture, changed, mask) == psnr(picture, another, mask) != psnr(picture, changed)


def _plain_ssim(a, b):
    """Wang et al. 2004, equation 13, window by window."""
    offset = np.arange(-5, 6)
    window = np.exp(-(offset[:, None] ** 2 + offset**2) / (2 * 1.5**2))
    window = (window / window.sum())[..., None]
    values = np.zeros((a.shape[0] - 10, a.shape[1] - 10, 3))
    for i, j in np.ndindex(*values.shape[:2]):
        x, y = a[i : i + 11, j : j + 11].astype(float), b[i : i + 11, j : j + 11].astype(float)
        mx, my = (window * x).sum((0, 1)), (window * y).sum((0, 1))
        vx, vy = (window * (x - mx) ** 2).sum((0, 1)), (window * (y - my) ** 2).sum((0, 1))
        both = (window * (x - mx) * (y - my)).sum((0, 1))
        values[i, j] = (2 * mx * my + 1e-4) * (2 * both + 9e-4)
        values[i, j] /= (mx**2 + my**2 + 1e-4) * (vx + vy + 9e-4)
    return values


def test_ssim_is_the_published_formula(picture, another):
    a, b = picture[:24, :30], another[:24, :30]
    values = _plain_ssim(a, b)
    assert ssim(a, b) == pytest.approx(values.mean(), abs=1e-6)
    mask = np.zeros((24, 30), bool)
    mask[8:14, 3:20] = True
    assert ssim(a, b, mask) == pytest.approx(values[mask[5:-5, 5:-5]].mean(), abs=1e-6)
    assert ssim(a, b, np.ones_like(mask)) == ssim(a, b)


def test_ssim_needs_scikit_image(picture, monkeypatch):
    monkeypatch.setitem(sys.modules, "skimage.metrics", None)
    with pytest.raises(MissingPackage, match=r"mitex\[nerf\]"):
        ssim(picture, picture)


@pytest.mark.parametrize("measure", ALL)
def test_measures_are_symmetric(measure, picture, another):
    assert measure(picture, another) == pytest.approx(measure(another, picture), rel=1e-6)


@pytest.mark.parametrize(("measure", "best"), [(ssim, 1), (vgg_distance, 0), (single_image_frechet, 0)])
def test_equal_images_are_at_the_best_value(measure, best, picture):
    assert measure(picture, picture) == pytest.approx(best, abs=1e-9)


@pytest.mark.parametrize("measure", ALL)
@pytest.mark.parametrize("spoil", [_blurred, _noisy])
def test_measures_tell_more_damage_from_less(measure, spoil, picture):
    strengths = (0.5, 1.0, 2.0, 4.0) if spoil is _blurred else (0.02, 0.05, 0.1, 0.2)
    values = [measure(picture, spoil(picture, strength)) for strength in strengths]
    worse = values if measure in (vgg_distance, single_image_frechet) else [-v for v in values]
    assert all(a < b for a, b in zip(worse[:-1], worse[1:], strict=True)), values
    assert (worse[0] > 0) == (measure in (vgg_distance, single_image_frechet))


def test_vgg_distance_is_written_out(picture, another):
    layers = ("relu2_1", "relu3_3")
    maps = Vgg16("max", "float32").features(torch.from_numpy(np.stack((picture, another))), layers)
    expected = 0.0
    for layer in layers:
        a, b = maps[layer].double().flatten(1, 2)
        cosines = [float(x @ y / (x.norm() * y.norm())) for x, y in zip(a, b, strict=True)]
        expected += np.mean([2 - 2 * c for c in cosines])
    assert vgg_distance(picture, another, layers=layers) == pytest.approx(expected, rel=1e-6)


def test_vgg_distance_under_a_mask_is_that_of_whole_cells(picture, another):
    """Of an odd size, whose last rows and columns the deeper layers drop."""
    a, b = picture[:63, :47], another[:63, :47]
    mask = np.ones(a.shape[:2], bool)
    layers = ("relu3_1", "relu4_1")
    assert vgg_distance(a, b, mask, layers) == pytest.approx(vgg_distance(a, b, layers=layers))
    mask[:, :9] = False  # touches the first three columns of relu3_1, the first two of relu4_1
    expected = 0.0
    for layer, first in zip(layers, (3, 2), strict=True):
        one, other = Vgg16("max", "float32").features(torch.from_numpy(np.stack((a, b))), [layer])[layer]
        cosines = torch.nn.functional.cosine_similarity(one, other, dim=2)[:, first:]
        expected += (2 - 2 * cosines).mean().item()
    assert vgg_distance(a, b, mask, layers) == pytest.approx(expected, rel=1e-4)


def _gaussian(rng, channels, rank):
    factor = rng.normal(size=(channels, rank))
    return rng.normal(size=channels), factor @ factor.T / rank


def _as_tensors(*arrays):
    return [torch.from_numpy(np.asarray(a, np.float64)) for a in arrays]


def test_frechet_distance_of_diagonal_gaussians_is_in_closed_form(rng):
    means, deviations = rng.normal(size=(2, 6)), rng.uniform(0, 2, (2, 6))
    expected = ((means[0] - means[1]) ** 2 + (deviations[0] - deviations[1]) ** 2).sum()
    a, b = (_as_tensors(m, np.diag(d**2)) for m, d in zip(means, deviations, strict=True))
    assert gaussian_frechet(*a, *b) == pytest.approx(expected, rel=1e-10)


@pytest.mark.parametrize("rank", [40, 12, 3])
def test_frechet_distance_is_that_of_the_matrix_square_root(rng, rank):
    (mean_a, a), (mean_b, b) = (_gaussian(rng, 12, rank) for _ in range(2))
    # SciPy's root needs regular matrices; the distance is continuous.
    regular = [m + 1e-10 * np.eye(12) for m in (a, b)]
    root = scipy.linalg.sqrtm(regular[0] @ regular[1])
    expected = ((mean_a - mean_b) ** 2).sum() + np.trace(a + b - 2 * np.real(root))
    distance = gaussian_frechet(*_as_tensors(mean_a, a, mean_b, b))
    assert distance == pytest.approx(expected, rel=1e-4 if rank < 12 else 1e-8)


def test_frechet_distance_of_singular_gaussians_has_no_rounding_to_speak_of(rng):
    mean, a = _gaussian(rng, 64, 5)
    assert gaussian_frechet(*_as_tensors(mean, 1e4 * a, mean, 1e4 * a)) < 1e-7


def test_frechet_distance_of_feature_vectors_is_that_of_their_gaussians(rng):
    a, b = rng.normal(size=(500, 3)) * [1, 2, 0.5], rng.normal(size=(300, 3)) + [1, 0, 0]
    expected = gaussian_frechet(
        *_as_tensors(a.mean(0), np.cov(a, rowvar=False), b.mean(0), np.cov(b, rowvar=False))
    )
    assert metrics.frechet_distance(*_as_tensors(a, b)) == pytest.approx(expected, rel=1e-10)


def test_single_image_frechet_knows_the_texture_not_the_place(picture, another):
    shifted = np.roll(picture, (SIZE // 2, SIZE // 4), (0, 1))
    cropped = picture[: SIZE * 3 // 4]
    far = single_image_frechet(picture, another)
    assert single_image_frechet(picture, shifted) < 0.1 * far
    assert single_image_frechet(picture, cropped) < 0.3 * far
    assert vgg_distance(picture, shifted) > 0.3 * vgg_distance(picture, another)


def test_single_image_frechet_takes_the_positions_of_each_mask(picture, another):
    """Each half of a composite has the statistics of what is there, away from the border."""
    mask = _left(picture)
    both = np.where(mask[..., None], picture, another)
    inner = np.zeros_like(mask)
    inner[:, : SIZE // 2 - 16] = True
    assert single_image_frechet(both, picture, mask_a=inner, mask_b=inner) < 1e-9
    assert single_image_frechet(both, another, mask_a=inner, mask_b=inner) > 1
    assert single_image_frechet(both, picture, mask_b=inner) > 1


@pytest.mark.parametrize("measure", PAIRED)
def test_images_of_different_sizes_are_refused(measure, picture):
    with pytest.raises(ImageError, match="give two of the same size"):
        measure(picture, picture[1:])


@pytest.mark.parametrize("measure", ALL)
@pytest.mark.parametrize(
    ("spoil", "problem"),
    [
        (lambda x: x[..., :2], "shape"),
        (lambda x: x[None], "shape"),
        (lambda x: x[:0], "shape"),
        (lambda x: (255 * x).astype(np.uint8), "uint8"),
        (lambda x: np.where(np.arange(SIZE)[:, None, None] == 3, np.nan, x), "NaN"),
    ],
)
def test_unusable_images_are_refused(measure, spoil, problem, picture):
    with pytest.raises(ImageError, match=problem):
        measure(spoil(picture), spoil(picture))
    with pytest.raises(ImageError):
        measure(picture, spoil(picture))


@pytest.mark.parametrize("measure", ALL)
@pytest.mark.parametrize(
    ("mask", "problem"),
    [
        (np.ones((SIZE, SIZE - 1), bool), "a mask of bool"),
        (np.ones((SIZE, SIZE), np.uint8), "a mask of uint8"),
        (np.zeros((SIZE, SIZE), bool), "the mask leaves nothing"),
    ],
)
def test_unusable_masks_are_refused(measure, mask, problem, picture):
    options = {"mask_b": mask} if measure is single_image_frechet else {"mask": mask}
    with pytest.raises(ImageError, match=problem):
        measure(picture, picture, **options)


def test_images_that_are_too_small_are_refused(picture):
    with pytest.raises(ImageError, match="SSIM"):
        ssim(picture[:10], picture[:10])
    with pytest.raises(ConfigError, match="too small"):
        vgg_distance(picture[:15], picture[:15])
    with pytest.raises(ImageError, match="covariance"):
        single_image_frechet(picture[:3, :3], picture)


def test_unknown_layers_are_refused(picture):
    with pytest.raises(ConfigError, match="no layer"):
        vgg_distance(picture, picture, layers=["relu9_9"])
    for options in ({}, {"mask_a": np.ones((SIZE, SIZE), bool)}):
        with pytest.raises(ConfigError, match="no layer"):
            single_image_frechet(picture, picture, layer="conv1", **options)
