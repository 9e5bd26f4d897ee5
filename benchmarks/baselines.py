"""Parts of the older methods beside the ordinary way to compute them.

usage: python -m benchmarks.baselines [--quick]

Gram matrices of a picture of 512 x 512 and their gradient, as `gatys`, `multi_view_gram` and `style_mesh`
need them: read within the frozen stack, and from whole maps under autograd. The generator of
`solid_texture` on a slice of 128 voxels across each axis, and its gradient: by flat convolutions, and by
torch's of three dimensions. Both ways run in one process on the same threads.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from unittest.mock import patch

import torch
import torch.nn.functional as F
from rich.console import Console
from rich.table import Table

from benchmarks.nca import best, cpu
from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.losses import gram_matrix
from mitex.methods.baselines.multi_view_gram import MultiViewConfig
from mitex.methods.baselines.solid_texture import SolidConfig, generator
from mitex.methods.baselines.solid_texture.task import SolidTask

Work = Callable[[], object]


def gram_matrices(side: int) -> tuple[Work, Work]:
    """Of a picture, with the gradient: ours, and the ordinary way."""
    network, layers = Vgg16(), MultiViewConfig().layers
    picture = torch.rand(1, side, side, 3, generator=torch.Generator().manual_seed(0), requires_grad=True)

    def backward(grams: dict[str, torch.Tensor]) -> None:
        torch.stack([gram.square().mean() for gram in grams.values()]).sum().backward()

    def ordinary() -> None:
        maps = network.features(picture, layers)
        backward({name: gram_matrix(values.flatten(1, 2)) for name, values in maps.items()})

    return lambda: backward(network.grams(picture, layers)), ordinary


def slices(side: int) -> tuple[Work, Work]:
    """A training step of `solid_texture`: ours, and with torch's convolutions."""
    exemplar = Exemplar.of("lava").of_albedo()
    task = SolidTask(SolidConfig(slice_size=side, exemplar_size=2 * side), exemplar)

    def step() -> None:
        task.loss(0, torch.Generator().manual_seed(0)).value.backward()

    def ordinary() -> None:
        with patch.object(generator, "convolve", F.conv3d):
            step()

    return step, ordinary


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description="Parts of the older methods beside the ordinary way.")
    parser.add_argument("--quick", action="store_true", help="smaller inputs: does it run?")
    quick = parser.parse_args().quick
    table = Table("part", "ours [ms]", "ordinary [ms]", "ratio")
    for name, (ours, ordinary) in {
        "Gram matrices and gradient": gram_matrices(64 if quick else 512),
        "step of solid_texture": slices(32 if quick else 128),
    }.items():
        times = [best(work, 1 if quick else 5) for work in (ours, ordinary)]
        table.add_row(name, *(f"{time:.0f}" for time in times), f"{times[0] / times[1]:.2f}")
    console = Console(width=100)
    console.print(cpu())
    console.print(table)


if __name__ == "__main__":
    main()
