"""What the tests of a module share: features of exemplars and hulls of captures, which many tasks ask for."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.features.frozen import FrozenConv
from mitex.methods.nerf.capture.capture import Capture
from mitex.methods.nerf.field.occupancy import hull_cells
from mitex.methods.nerf.training import plain, task
from mitex.methods.surface import comparison

HULLS: dict[tuple[str, int], np.ndarray] = {}


@pytest.fixture(scope="module")
def exemplar() -> Exemplar:
    """A small picture, for whoever has no other one."""
    return Exemplar.load("lava").resized(48).of_albedo()


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
def known_hulls() -> Iterator[None]:
    """What the masks of a capture leave takes a second, and is asked for by each of many tasks."""

    def cached(capture: Capture, side: int) -> np.ndarray:
        key = capture.metadata()["capture_key"], side
        if key not in HULLS:
            HULLS[key] = hull_cells(capture, side)
        return HULLS[key].copy()

    with pytest.MonkeyPatch.context() as patch:
        for module in (plain, task):
            patch.setattr(module, "hull_cells", cached)
        yield


@pytest.fixture(scope="module")
def small_previews() -> Iterator[None]:
    """Previews of surface textures have images of 16 pixels, in place of 384."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("mitex.methods.surface.task.VIEW", 16)
        yield
