"""Names of the convolution layers of VGG (Simonyan & Zisserman 2015), known without torch."""

from __future__ import annotations

from collections.abc import Sequence

WIDTHS = (64, 128, 256, 512, 512)  # channels of the blocks


def _names(counts: Sequence[int]) -> tuple[str, ...]:
    """reluBLOCK_CONVOLUTION, for blocks of so many convolutions."""
    return tuple(f"relu{block}_{i}" for block, count in enumerate(counts, 1) for i in range(1, count + 1))


LAYERS = _names((2, 2, 3, 3, 3))  # of VGG-16
LAYERS_19 = _names((2, 2, 4, 4, 4))
CHANNELS = {name: WIDTHS[int(name[4]) - 1] for name in LAYERS_19}


def with_poolings(convolutions: Sequence[str]) -> tuple[str, ...]:
    """All layers of a network with these convolutions, poolings included, as they are computed."""
    blocks = range(1, len(WIDTHS) + 1)
    return tuple(
        name
        for n in blocks
        for name in (*(layer for layer in convolutions if layer.startswith(f"relu{n}_")), f"pool{n}")
    )
