"""The feature vectors of an exemplar in the image network."""

from __future__ import annotations

import numpy as np
import torch
import torch.nn.functional as F

from mitex.features import Vgg16

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
    around = ((MARGIN, MARGIN), (MARGIN, MARGIN), (0, 0))
    padded = torch.from_numpy(np.pad(image.numpy(), around, mode="reflect"))[None]
    sources = {layer: _source(network, layer) for layer in layers}
    with torch.no_grad():
        maps = network.features(padded, dict.fromkeys(sources.values()))
    vectors = {}
    for layer, source in sources.items():
        features, shrunk = maps[source], 1 << (int(layer[4]) - 1)
        if layer != source:
            features, shrunk = _pooled(network, features), 2 * shrunk
        cut = min(MARGIN // shrunk, (features.shape[1] - 1) // 2, (features.shape[2] - 1) // 2)
        vectors[layer] = features[0, cut : features.shape[1] - cut, cut : features.shape[2] - cut].flatten(
            0, 1
        )
    return vectors


def _source(network: Vgg16, layer: str) -> str:
    """The convolution that a layer is, or that it pools."""
    return layer if layer in network.index else max(x for x in network.index if x[4] == layer[4])


def _pooled(network: Vgg16, maps: torch.Tensor) -> torch.Tensor:
    pool = F.avg_pool2d if network.pool == "average" else F.max_pool2d
    return pool(maps.permute(0, 3, 1, 2), 2).permute(0, 2, 3, 1)
