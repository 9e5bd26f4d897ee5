"""VGG-16 as an ordinary float32 network under autograd, and pictures to show it."""

import torch
import torch.nn.functional as F

from benchmarks import naive
from mitex.exemplar import Exemplar

EXEMPLARS = ("cobblestone", "lava", "scales", "wicker")


def plain_vgg(
    images: torch.Tensor, pool: str = "average", scale: dict[str, float] | None = None
) -> dict[str, torch.Tensor]:
    """All 13 layers, (K, h, w, C) each, of images (K, H, W, 3) in [0, 1]; `scale` divides layers."""
    return naive.vgg(images, naive.vgg_weights(), pool, scale)


def exemplars(size: int) -> torch.Tensor:
    """Albedos of four of the embedded exemplars, (4, size, size, 3) sRGB in [0, 1]."""
    maps = [Exemplar.load(name).resized(size).maps["albedo"] for name in EXEMPLARS]
    return torch.stack([torch.from_numpy(m) for m in maps])


def cosine(a: torch.Tensor, b: torch.Tensor) -> float:
    """Of the angle between two tensors taken as vectors."""
    return F.cosine_similarity(a.double().flatten(), b.double().flatten(), dim=0).item()


def relative_error(a: torch.Tensor, b: torch.Tensor) -> float:
    """|a - b| / |b|, Euclidean."""
    return ((a.double() - b.double()).norm() / b.double().norm()).item()
