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
    known: dict[tuple, tuple[Vgg16, dict[str, torch.Tensor]]] = {}
    compute = comparison.exemplar_features

    def features(network: Vgg16, image: torch.Tensor, layers: tuple[str, ...]) -> dict[str, torch.Tensor]:
        # Networks with the package's weights share their layers.
        layers_of = [id(one) for one in network.operations if isinstance(one, FrozenConv)]
        key = (network.pool, *layers_of, image.shape, image.numpy().tobytes(), layers)
        if key not in known:
            known[key] = network, compute(network, image, layers)  # while it lives, no other has its layers
        return known[key][1]

    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(comparison, "exemplar_features", features)
        yield


@pytest.fixture(scope="module")
def small_previews() -> Iterator[None]:
    """Previews of surface textures have images of 16 pixels, in place of 384."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mitex.methods.surface.task.VIEW", 16)
        yield
