"""How far a picture is from another: for evaluations, not for training.

Images are (H, W, 3) float32 arrays, sRGB in [0, 1]. A mask (H, W) bool leaves only its pixels to count; what
lies outside still shows through the windows and receptive fields of those near its border, so both pictures
should have the same background.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from functools import cache
from typing import cast

import numpy as np
import torch
import torch.nn.functional as F

from mitex.errors import ImageError
from mitex.features import Vgg16
from mitex.optional import optional

PERCEPTUAL_LAYERS = ("relu1_2", "relu2_2", "relu3_3", "relu4_3", "relu5_3")
FRECHET_LAYER = "relu2_2"
SSIM_SIGMA, SSIM_RADIUS = 1.5, 5  # of the window's Gaussian [pixels]


def psnr(a: np.ndarray, b: np.ndarray, mask: np.ndarray | None = None) -> float:
    """Peak signal-to-noise ratio, of the mean over pixels and channels [dB]; infinite for equal images.

    Args:
        a, b: (H, W, 3) float in [0, 1]; so of all functions here.
        mask: (H, W), pixels that count; None for all.

    Raises:
        ImageError: images of different or unusable shapes, or an unusable mask; so of all functions here.
    """
    _check_pair(a, b)
    squares = np.square(a.astype(np.float64) - b)
    error = float(_masked(squares, mask).mean())
    return math.inf if error == 0 else -10 * math.log10(error)


def ssim(a: np.ndarray, b: np.ndarray, mask: np.ndarray | None = None) -> float:
    """Structural similarity in [-1, 1], 1 for equal images (Wang et al. 2004: Gaussian windows, sigma 1.5).

    The mean over channels and over the pixels whose 11 x 11 windows lie in the image.

    Raises:
        MissingPackage: scikit-image is not installed.
        ImageError: as in `psnr`, or images smaller than a window.
    """
    _check_pair(a, b)
    if min(a.shape[:2]) <= 2 * SSIM_RADIUS:
        raise ImageError(f"images of {a.shape[1]} x {a.shape[0]} have no SSIM", "give 11 x 11 pixels or more")
    result = optional("skimage.metrics", "nerf").structural_similarity(
        a.astype(np.float64),
        b.astype(np.float64),
        data_range=1.0,
        channel_axis=2,
        gaussian_weights=True,
        sigma=SSIM_SIGMA,
        use_sample_covariance=False,
        full=True,
    )
    _, maps = cast(tuple[float, np.ndarray], result)  # as of `full`
    inner = slice(SSIM_RADIUS, -SSIM_RADIUS)
    if mask is not None:
        _check_mask(a, mask)
        mask = mask[inner, inner]
    return float(_masked(maps[inner, inner], mask).mean())


def vgg_distance(
    a: np.ndarray,
    b: np.ndarray,
    mask: np.ndarray | None = None,
    layers: Sequence[str] = PERCEPTUAL_LAYERS,
) -> float:
    """Perceptual distance in VGG-16 features, in LPIPS's place. It is NOT LPIPS, and not comparable with it.

    As in LPIPS, the feature vectors of each position are made unit, and their squared differences averaged
    over positions and summed over layers (Zhang et al. 2018, equation 1). LPIPS then weighs each channel as
    human judgements have taught it; here every channel weighs the same.

    Args:
        a: one image.
        b: the other, of the same size.
        mask: pixels that count; in deeper layers, positions whose whole cell does.
        layers: names out of `mitex.features.LAYERS`.

    Returns:
        0 for equal images, at most 2 a layer.

    Raises:
        ConfigError: an unknown layer, or images too small for one.
        ImageError: as in `psnr`.
    """
    _check_pair(a, b)
    total = 0.0
    for layer, maps in _features(np.stack((a, b)), layers).items():
        one, other = F.normalize(maps.double(), dim=3)
        squares = (one - other).square().sum(2).numpy()
        total += float(_masked(squares, whole_cells(a, mask, layer)).mean())
    return total


def single_image_frechet(
    a: np.ndarray,
    b: np.ndarray,
    layer: str = FRECHET_LAYER,
    mask_a: np.ndarray | None = None,
    mask_b: np.ndarray | None = None,
) -> float:
    """Distance of two pictures as textures: wherever things are, which features, and which with which.

    The idea of the single-image Frechet inception distance (Shaham et al. 2019) on features of VGG-16: those
    of all positions of one picture are taken as a Gaussian, and compared by `gaussian_frechet`. It is NOT
    SIFID, whose network is another; features are in units of their layer's mean activation.

    Args:
        a: one image.
        b: the other; its size may differ.
        layer: out of `mitex.features.LAYERS`.
        mask_a: pixels of `a` that count, as in `vgg_distance`.
        mask_b: the same of `b`.

    Raises:
        ConfigError: an unknown layer, or images too small for it.
        ImageError: an image or mask of an unusable shape, or too few positions.
    """
    return frechet_distance(*(_vectors(image, layer, mask) for image, mask in ((a, mask_a), (b, mask_b))))


def gaussian_frechet(
    mean_a: torch.Tensor, covariance_a: torch.Tensor, mean_b: torch.Tensor, covariance_b: torch.Tensor
) -> float:
    """Squared 2-Wasserstein distance of two Gaussians: `|m_a - m_b|^2 + tr(S_a + S_b - 2 (S_a S_b)^(1/2))`.

    Args:
        mean_a: (C,) float64; `mean_b` likewise.
        covariance_a: (C, C) float64, symmetric, may be singular; `covariance_b` likewise.
    """
    # The eigenvalues of S_a S_b are the squared singular values of the product of the symmetric roots. Taken
    # from there, none comes out negative or complex, and nothing is lost where the covariances are singular.
    cross = torch.linalg.matrix_norm(_root(covariance_a) @ _root(covariance_b), "nuc")
    spread = covariance_a.trace() + covariance_b.trace() - 2 * cross
    return float((mean_a - mean_b).square().sum() + spread.clamp(min=0))


def frechet_distance(a: torch.Tensor, b: torch.Tensor) -> float:
    """`gaussian_frechet` of two sets of feature vectors (n, C), (m, C) float64.

    Raises:
        ImageError: a set of fewer than two.
    """
    if min(len(a), len(b)) < 2:
        raise ImageError("a single position has no covariance", "give a larger image or mask")
    return gaussian_frechet(a.mean(0), torch.cov(a.T), b.mean(0), torch.cov(b.T))


def _root(symmetric: torch.Tensor) -> torch.Tensor:
    """The symmetric square root of a positive semidefinite matrix."""
    values, vectors = torch.linalg.eigh(symmetric)
    return (vectors * values.clamp(min=0).sqrt()) @ vectors.T


@cache
def evaluation_network() -> Vgg16:
    """VGG-16 of the package's weights, layers divided by their mean activation: that of all evaluations."""
    # Pooling as trained, and full precision: evaluations should agree between machines.
    return Vgg16("max", "float32")


def _features(images: np.ndarray, layers: Sequence[str]) -> dict[str, torch.Tensor]:
    with torch.no_grad():
        return evaluation_network().features(torch.from_numpy(np.asarray(images, np.float32)), layers)


def _vectors(image: np.ndarray, layer: str, mask: np.ndarray | None) -> torch.Tensor:
    """Features of the positions that count, (n, C) float64."""
    _check(image)
    (maps,) = _features(image[None], [layer])[layer].double().numpy()
    return torch.from_numpy(_masked(maps, whole_cells(image, mask, layer)))


def whole_cells(image: np.ndarray, mask: np.ndarray | None, layer: str) -> np.ndarray | None:
    """The mask (h, w) of a layer's map for that of an image: the cells of pixels that lie in it wholly."""
    if mask is None:
        return None
    _check_mask(image, mask)
    rows, columns = evaluation_network().extent(layer, *mask.shape)
    side = 2 ** (int(layer[4]) - 1)
    whole = mask[: rows * side, : columns * side].reshape(rows, side, columns, side)
    return np.asarray(whole.all((1, 3)))


def _masked(values: np.ndarray, mask: np.ndarray | None) -> np.ndarray:
    """Values (H, W) or (H, W, C) at the places of a mask (H, W), in a row; all without one."""
    if mask is None:
        return values.reshape(-1, *values.shape[2:])
    _check_mask(values, mask)
    if not mask.any():
        raise ImageError("the mask leaves nothing to compare", "give a larger mask")
    return values[mask]


def _check_pair(a: np.ndarray, b: np.ndarray) -> None:
    _check(a)
    _check(b)
    if a.shape != b.shape:
        raise ImageError(f"images of {a.shape} and {b.shape}", "give two of the same size")


def _check(image: np.ndarray) -> None:
    if image.ndim != 3 or image.shape[2] != 3 or not image.size:
        raise ImageError(f"an image of shape {image.shape}", "give (H, W, 3)")
    if not np.issubdtype(image.dtype, np.floating):
        raise ImageError(f"an image of {image.dtype}", "give floats in [0, 1]")
    if not np.isfinite(image).all():
        raise ImageError("an image holds NaN or infinite values", "check the step that made it")


def _check_mask(image: np.ndarray, mask: np.ndarray) -> None:
    if mask.shape != image.shape[:2] or mask.dtype != np.bool_:
        raise ImageError(f"a mask of {mask.dtype} {mask.shape}", f"give bools of shape {image.shape[:2]}")
