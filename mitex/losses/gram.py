"""Gram matrices of features (Gatys et al. 2015)."""

from __future__ import annotations

from collections.abc import Mapping

import torch


def gram_matrix(features: torch.Tensor) -> torch.Tensor:
    """Mean outer product of feature vectors: (..., n, C) -> (..., C, C), divided by n (not by C)."""
    return features.mT @ features / features.shape[-2]


def gram_targets(maps: Mapping[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Layer -> (C, C) Gram matrix of an exemplar whose maps are (1, h, w, C)."""
    return {layer: gram_matrix(values[0].flatten(0, 1)) for layer, values in maps.items()}


def gram_loss(
    features: Mapping[str, torch.Tensor],
    targets: Mapping[str, torch.Tensor],
    weights: Mapping[str, float] | None = None,
) -> torch.Tensor:
    """Squared distance of Gram matrices, averaged over their C x C entries and summed over layers.

    Args:
        features: layer -> (K, n, C) feature vectors of the images.
        targets: layer -> (C, C) Gram matrices of the exemplar, for the layers to be matched.
        weights: layer -> weight, 1 where not named.

    Returns:
        Scalar, averaged over the K images.
    """
    return gram_distance({layer: gram_matrix(features[layer]) for layer in targets}, targets, weights)


def gram_distance(
    grams: Mapping[str, torch.Tensor],
    targets: Mapping[str, torch.Tensor],
    weights: Mapping[str, float] | None = None,
) -> torch.Tensor:
    """`gram_loss` of Gram matrices (..., C, C) that are known already."""
    total = torch.zeros((), device=next(iter(grams.values())).device)
    for layer, target in targets.items():
        weight = 1.0 if weights is None else weights.get(layer, 1.0)
        total = total + weight * (grams[layer] - target).square().mean()
    return total
