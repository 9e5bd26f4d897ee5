"""What the features of an exemplar are like: Gram matrices of the image network."""

from __future__ import annotations

import torch
import torch.nn.functional as F

from mitex.features import Vgg16
from mitex.losses import gram_matrix

MARGIN = 64  # of mirrored pixels around the exemplar


def exemplar_features(
    network: Vgg16, image: torch.Tensor, layers: tuple[str, ...]
) -> dict[str, torch.Tensor]:
    """Feature vectors of one image, free of its border.

    The image is continued by mirroring, and what the features see of the margin is cut off again: zeros
    around it, as the network was trained with, would become part of the texture.

    Args:
        network: frozen features.
        image: (H, W, 3) sRGB in [0, 1].
        layers: "reluB_I" or "poolB".

    Returns:
        layer -> (n, C) float32.
    """
    margin = min(MARGIN, (min(image.shape[:2]) - 1) // 32 * 32)
    padded = F.pad(image.permute(2, 0, 1)[None], (margin,) * 4, mode="reflect").permute(0, 2, 3, 1)
    found = {}
    for layer in layers:
        features, cut = _layer(network, padded, layer, margin)
        found[layer] = features[0, cut : features.shape[1] - cut, cut : features.shape[2] - cut].flatten(0, 1)
    return found


def exemplar_grams(network: Vgg16, image: torch.Tensor, layers: tuple[str, ...]) -> dict[str, torch.Tensor]:
    """layer -> (C, C) Gram matrix of `exemplar_features`."""
    return {name: gram_matrix(f) for name, f in exemplar_features(network, image, layers).items()}


@torch.no_grad()
def _layer(network: Vgg16, images: torch.Tensor, layer: str, margin: int) -> tuple[torch.Tensor, int]:
    """A layer's map, and the margin in it."""
    block = int(layer[4])
    if layer.startswith("relu"):
        return network.features(images, [layer])[layer], margin >> (block - 1)
    last = max(name for name in network.index if name.startswith(f"relu{block}_"))
    maps = network.features(images, [last])[last].permute(0, 3, 1, 2)
    pooled = F.avg_pool2d(maps, 2) if network.pool == "average" else F.max_pool2d(maps, 2)
    return pooled.permute(0, 2, 3, 1), margin >> block
