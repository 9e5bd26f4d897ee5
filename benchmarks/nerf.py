"""How fast the field of a radiance texture is evaluated and trained.

repetition: python -m benchmarks.nerf [--quick] [--run RUN]

Points per second through hash grids and networks, forwards, and forwards and backwards to tables and weights,
by `drjit.nn` and by plain torch in the same run; and forwards as it is packed for pictures. RUN, a finished
run of `mitex fit nerf`, adds what is done with it: a texture is quilted, put on a mesh, and looked at.
"""

from __future__ import annotations

import argparse
import resource
import statistics
import time
from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import torch
from rich.console import Console
from rich.table import Table

from benchmarks import torch_field
from mitex.bridge import call
from mitex.mesh import embedded
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.config import PRESETS, NerfConfig
from mitex.methods.nerf.field.decoder import Decoder
from mitex.methods.nerf.field.encoding import Encoding
from mitex.methods.nerf.field.mlp import weight_bound
from mitex.methods.nerf.field.networks import weight_shapes
from mitex.methods.nerf.field.tensors import tensor
from mitex.render.shell import shell_still
from mitex.runtime import bfloat16_is_fast, init, keep_freed_memory, lower_worker_priority
from mitex.runtime.jit import dr, mi

init()

TURNS, TURN = 6, 0.6  # of each that is measure, and their length [s]
TABLE = 17


def rates_of(points: int, works: Sequence[Callable[[], object]]) -> list[float]:
    """Points per second of each, once it is warm; medians, since other work disturbs some rounds.

    They take turns: the machine's own speed changes within seconds, and their ratios would with it.
    """
    times = [[] for _ in works]
    for work in works:
        work()
    for _ in range(TURNS):
        for work, own in zip(works, times, strict=True):
            start = time.perf_counter()
            while (now := time.perf_counter()) < start + TURN:
                work()
                own.append(time.perf_counter() - now)
    return [points / statistics.median(own) for own in times]


def parameters(config: NerfConfig, encoding: Encoding) -> list[torch.Tensor]:
    """Tables and weights, attached."""
    generator = torch.Generator().manual_seed(0)
    tables = [torch.empty(size).uniform_(-0.1, 0.1, generator=generator) for size in encoding.sizes]
    weights = [
        torch.empty(shape).uniform_(-weight_bound(shape), weight_bound(shape), generator=generator)
        for shape in weight_shapes(config)
    ]
    return [value.requires_grad_() for value in tables + weights]


def ours(
    encoding: Encoding,
    points: torch.Tensor,
    distance: torch.Tensor,
    tensors: list[torch.Tensor],
    packed: bool,
):
    """All outputs of the field, (N, 9), by Dr.Jit."""

    def run(points, distance, f, phase, *weights):
        foot = dr.unravel(mi.Point3f, points.array)
        features, phases = (encoding(k, foot, table.array) for k, table in enumerate((f, phase)))
        reflection = Decoder(weights, packed, bfloat16_is_fast())(features, phases, distance.array)
        return tensor(mi.ArrayXf(*torch_field.outputs(reflection)))

    return call(run, points, distance, *tensors)


def theirs(
    encoding: Encoding, points: torch.Tensor, distance: torch.Tensor, tensors: list[torch.Tensor]
) -> torch.Tensor:
    """The same by torch."""
    features, phases = (torch_field.encoded(encoding, k, points, tensors[k]) for k in range(2))
    return torch_field.decoded(features, phases, distance, tensors[2:])


def backward(result: torch.Tensor, tensors: list[torch.Tensor]) -> None:
    """Backwards to tables and weights."""
    torch.autograd.grad(result.sum(), tensors)


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="fewer points")
    parser.add_argument("--run", metavar="RUN", help="a captured texture")
    arguments = parser.parse_args()
    keep_freed_memory()  # these two as in a fit
    lower_worker_priority()
    Console(width=100).print(rates(1 << (14 if arguments.quick else 16)))
    if arguments.run:
        Console(width=100).print(uses(NerfTexture.load(arguments.run)))


def uses(texture: NerfTexture) -> Table:
    """Seconds for 1024 x 1024 texels, and for pictures of 512 x 512 rays with them on a mesh."""
    table = Table("seconds", "", title=f"{texture}")
    maps = measure(table, "1024 x 1024 texels quilted", lambda: texture.synthesize(1024, tileable=True))
    applied = measure(table, "put on the vase", lambda: texture.apply(embedded("vase"), maps))

    def frame():
        return shell_still(applied, applied.similarity, applied.outline, resolution=512, spp=1)

    measure(table, "first path-traced frame, with its kernels", frame)
    measure(table, "another one", frame)
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    table.add_row(f"{peak:.1f}", "GiB of memory at most")
    return table


def measure(table: Table, what: str, work: Callable[[], Any]) -> Any:
    """The result of `work`; a row tells how long it took."""
    start = time.perf_counter()
    result = work()
    table.add_row(f"{time.perf_counter() - start:.1f}", what)
    return result


def rates(count: int) -> Table:
    """Points per second."""
    dr.set_expand_threshold(2**26)
    generator = torch.Generator().manual_seed(1)
    points = torch.empty(count, 3).uniform_(-0.9, 0.9, generator=generator)
    distance = torch.empty(count).uniform_(-0.1, 0.1, generator=generator)
    table = Table(title=f"{count:,} points, tables of 2^{TABLE} entries [million points a second]")
    for name in ("", "forwards", "packed", "and backwards"):
        table.add_column(name)
    for preset in ("fast", "paper"):
        config: NerfConfig = replace(PRESETS[preset], table=TABLE)
        encoding = Encoding(config)
        tensors = parameters(config, encoding)
        fixed = [value.detach() for value in tensors]
        scene = encoding, points, distance
        forwards, backwards, *our_rates = rates_of(
            count,
            [
                lambda s=scene, f=fixed: theirs(*s, f),
                lambda s=scene, g=tensors: backward(theirs(*s, g), g),
                lambda s=scene, f=fixed: ours(*s, f, False),
                lambda s=scene, f=fixed: ours(*s, f, True),
                lambda s=scene, g=tensors: backward(ours(*s, g, False), g),
            ],
        )
        table.add_row(f"{preset}, torch", f"{forwards / 1e6:.2f}", "", f"{backwards / 1e6:.3f}")
        table.add_row(f"{preset}, drjit.nn", *(f"{r / 1e6:.2f}" for r in our_rates))
        against = (forwards, forwards, backwards)
        ratios = [f"{a / b:.1f} x" for a, b in zip(our_rates, against, strict=True)]
        table.add_row("", *ratios, end_section=True)
    return table


if __name__ == "__main__":
    main()
