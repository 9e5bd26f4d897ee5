"""Names of the convolution layers of VGG (Simonyan & Zisserman 2015), known without torch."""

from __future__ import annotations

from collections.abc import Sequence

from mitex.errors import ConfigError

WIDTHS = (64, 128, 256, 512, 512)  # channels of the blocks


def _names(counts: Sequence[int]) -> tuple[str, ...]:
    """reluBLOCK_CONVOLUTION, for blocks of so many convolutions."""
    return tuple(f"relu{block}_{i}" for block, count in enumerate(counts, 1) for i in range(1, count + 1))


LAYERS = _names((2, 2, 3, 3, 3))  # of VGG-16
LAYERS_19 = _names((2, 2, 4, 4, 4))
NETWORKS = {"vgg16": LAYERS, "vgg19": LAYERS_19}
CHANNELS = {name: WIDTHS[int(name[4]) - 1] for name in LAYERS_19}


def halvings(name: str) -> int:
    """How often the map of a layer is halved: 0 of relu1_2, 1 of pool1 and relu2_1."""
    return int(name[4]) - name.startswith("relu")


def check_layers(names: Sequence[str], known: Sequence[str] = LAYERS) -> None:
    """Raises a ConfigError if names are not some of a network's layers, by default of VGG-16's."""
    unknown = [name for name in names if name not in known]
    if unknown or not names:
        named = ", ".join(map(str, unknown)) or "none"
        raise ConfigError(f"VGG's layers to compare are {named}", f"use some of {', '.join(known)}")


def with_poolings(convolutions: Sequence[str]) -> tuple[str, ...]:
    """All layers of a network with these convolutions, poolings included, as they are computed."""
    blocks = range(1, len(WIDTHS) + 1)
    return tuple(
        name
        for n in blocks
        for name in (*(layer for layer in convolutions if layer.startswith(f"relu{n}_")), f"pool{n}")
    )
