"""The feature vectors of an exemplar in the image network."""

from __future__ import annotations

import numpy as np
import torch

from mitex.features import Vgg16
from mitex.features.layers import halvings

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
    with torch.no_grad():
        maps = network.features(padded, layers)
    vectors = {}
    for layer, features in maps.items():
        cut = min(MARGIN >> halvings(layer), (features.shape[1] - 1) // 2, (features.shape[2] - 1) // 2)
        vectors[layer] = features[0, cut : features.shape[1] - cut, cut : features.shape[2] - cut].flatten(
            0, 1
        )
    return vectors
