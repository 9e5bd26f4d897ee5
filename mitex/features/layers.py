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
CHANNELS = {name: WIDTHS[int(name[4]) - 1] for name in LAYERS_19}


def check_layers(names: Sequence[str]) -> None:
    """Raises a ConfigError if names are not some of VGG-16's layers."""
    unknown = [name for name in names if name not in LAYERS]
    if unknown or not names:
        named = ", ".join(map(str, unknown)) or "none"
        raise ConfigError(f"VGG-16's layers to compare are {named}", f"use some of {', '.join(LAYERS)}")


def with_poolings(convolutions: Sequence[str]) -> tuple[str, ...]:
    """All layers of a network with these convolutions, poolings included, as they are computed."""
    blocks = range(1, len(WIDTHS) + 1)
    return tuple(
        name
        for n in blocks
        for name in (*(layer for layer in convolutions if layer.startswith(f"relu{n}_")), f"pool{n}")
    )
