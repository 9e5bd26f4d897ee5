"""How near the patches of a texture come to its exemplar, as sets of patches: wherever things are."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from mitex.errors import ImageError
from mitex.evaluation.metrics import evaluation_network, frechet_distance, whole_cells
from mitex.evaluation.patches import Views, filled
from mitex.losses import gram_distance, gram_matrix, relaxed_transport

FINE, COARSE = "relu2_2", "relu4_1"  # layers of the Frechet distances
LAYERS = ("relu1_1", "relu2_1", "relu3_1", "relu4_1", "relu5_1")  # of transport and Gram matrices
SAMPLES = 2048  # feature vectors that the transport compares

Vectors = Mapping[str, torch.Tensor]  # layer -> (n, C)


@dataclass(frozen=True)
class Likeness:
    """Distances of two sets of patches; 0 for equal ones.

    Attributes:
        frechet_fine: Frechet distance of the features at relu2_2, of small details.
        frechet_coarse: the same at relu4_1, of larger structure.
        transport: relaxed optimal transport (MeshNCA, equation 4), summed over five layers.
        gram: squared distance of Gram matrices, the mean over five layers.
    """

    frechet_fine: float
    frechet_coarse: float
    transport: float
    gram: float


def exemplar_patches(image: np.ndarray, masks: np.ndarray, seed: int = 0) -> Views:
    """Patches of an image (H, W, 3), at random places, of which as much counts as of others.

    Args:
        image: sRGB in [0, 1].
        masks: (K, S, S) bool, of the patches that they shall be compared with: what the network sees of
            borders is the same then.
        seed: of the places.
    """
    generator = np.random.default_rng(seed)
    count, pixels = masks.shape[:2]
    height, width = (n - pixels for n in image.shape[:2])
    corners = zip(
        generator.integers(0, height + 1, count), generator.integers(0, width + 1, count), strict=True
    )
    patches = np.stack([image[y : y + pixels, x : x + pixels] for y, x in corners])
    return filled(patches, masks), masks


def patch_features(views: Views, layers: Sequence[str] = (*LAYERS, FINE)) -> Vectors:
    """Feature vectors (n, C) at all places of patches that count, layer by layer.

    Raises:
        ConfigError: patches too small for the deepest layer.
    """
    network, parts = evaluation_network(), {layer: [] for layer in layers}
    for image, mask in zip(*views, strict=True):
        with torch.no_grad():
            maps = network.features(torch.from_numpy(image)[None], parts)
        for layer, (values,) in maps.items():
            cells = whole_cells(image, mask, layer)
            assert cells is not None
            parts[layer].append(values[torch.from_numpy(cells)])
    return {layer: torch.cat(vectors) for layer, vectors in parts.items()}


def likeness(ours: Vectors, theirs: Vectors, seed: int = 0) -> Likeness:
    """Compares the `patch_features` of a texture with those of its exemplar.

    Raises:
        ImageError: fewer than two vectors in a layer.
    """
    if min(len(vectors[k]) for vectors in (ours, theirs) for k in vectors) < 2:
        raise ImageError(
            "too few places of the patches count", "give larger patches, or masks of more pixels"
        )
    generator = torch.Generator().manual_seed(seed)
    fine, coarse = (frechet_distance(ours[k].double(), theirs[k].double()) for k in (FINE, COARSE))
    transport = sum(
        float(relaxed_transport(_some(ours[k], generator), _some(theirs[k], generator))) for k in LAYERS
    )
    mine, target = ({k: gram_matrix(vectors[k].double()) for k in LAYERS} for vectors in (ours, theirs))
    return Likeness(fine, coarse, transport, float(gram_distance(mine, target)) / len(LAYERS))


def _some(vectors: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
    """(1, n, C) random vectors out of (m, C)."""
    return vectors[torch.randperm(len(vectors), generator=generator)[:SAMPLES]][None]
