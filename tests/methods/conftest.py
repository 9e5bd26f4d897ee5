"""What the tests of a module share: features of exemplars, which most tasks compare with the same ones."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
import torch

from mitex.features import Vgg16
from mitex.features.frozen import FrozenConv
from mitex.methods.surface import comparison


@pytest.fixture(scope="module")
def known_exemplars() -> Iterator[None]:
    """The features of an image in a network are computed once, for whichever tasks ask for them."""
    known: dict[tuple, dict[str, torch.Tensor]] = {}
    compute = comparison.exemplar_features

    def features(network: Vgg16, image: torch.Tensor, layers: tuple[str, ...]) -> dict[str, torch.Tensor]:
        key = (_fingerprint(network), image.shape, image.numpy().tobytes(), layers)
        if key not in known:
            known[key] = compute(network, image, layers)
        return known[key]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparison, "exemplar_features", features)
        yield


def _fingerprint(network: Vgg16) -> tuple:
    """Differs between networks that see differently: by their weights, or by how they pool."""
    layers = [one for one in network.operations if isinstance(one, FrozenConv)]
    return network.pool, network.dtype, *(float(one.weight.float().abs().sum()) for one in layers)


@pytest.fixture(scope="module")
def small_previews() -> Iterator[None]:
    """Previews of surface textures have images of 16 pixels, in place of 384."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mitex.methods.surface.task.VIEW", 16)
        yield
