"""How fast a surface texture is prepared and synthesized.

usage: python -m benchmarks.surface [--quick]

For a small and a large closed mesh and several resolutions: the layout (xatlas), the precomputation (texels,
frames, taps, groups), and a step of the synthesis, its rate beside that of plain bfloat16 matrix products
right before and after it. The paper's figures (12 cores in Rust; a large GPU) stand beside them.
"""

from __future__ import annotations

import argparse
import math
import resource
import time
from dataclasses import dataclass, replace

import numpy as np
import torch
from rich.console import Console
from rich.table import Table

from mitex.features.frozen import GramTap
from mitex.features.layers import CHANNELS, LAYERS, with_poolings
from mitex.mesh import Mesh, icosphere
from mitex.methods.layout import with_layout
from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.levels import Levels
from mitex.methods.surface.network import SurfaceVgg
from mitex.runtime import keep_freed_memory

PREPARATION = {(5_120, 256): 21, (5_120, 512): 42, (5_120, 1024): 104, (200_000, 1024): 150}  # the paper [s]
STEP = {256: 0.46, 512: 1.5, 1024: 5.7}  # the paper [s]


@dataclass
class Result:
    """Of one mesh at one resolution: faces, side of the texture, used texels, times [s], operations of a
    step, plain products per second, and how many elements of each level a group joins.
    """

    faces: int
    resolution: int
    texels: int
    layout: float
    prepared: float
    step: float
    operations: float
    products: float
    joined: list[float]


def measure(mesh: Mesh, resolution: int, repetitions: int) -> Result:
    """Prepares a mesh and times the best of some steps."""
    config = replace(PRESETS["fast"], resolution=resolution, scales=0)
    start = time.perf_counter()
    domain = SurfaceDomain.of(with_layout(mesh, config.resolution), config)
    between = time.perf_counter()
    levels = domain.compute_levels()
    prepared = time.perf_counter()
    network = SurfaceVgg(levels)
    values = torch.rand(len(levels.order), 3).requires_grad_()
    before = product_rate()
    step = min(_step(network, values) for _ in range(repetitions + 1))
    after = product_rate()
    return Result(
        faces=len(mesh.faces),
        resolution=resolution,
        texels=len(levels.order),
        layout=between - start,
        prepared=prepared - between,
        step=step,
        operations=operations(levels),
        products=max(before, after),
        joined=[len(level.taps) / len(level.sizes) for level in levels.levels],
    )


def _step(network: SurfaceVgg, values: torch.Tensor) -> float:
    start = time.perf_counter()
    grams = network.read(values, {name: GramTap(network.index_of(name)) for name in with_poolings(LAYERS)})
    torch.stack([gram.square().mean() for gram in grams.values()]).sum().backward()
    values.grad = None
    return time.perf_counter() - start


def operations(levels: Levels) -> float:
    """Floating-point operations of a step: convolutions, there and back, and Gram matrices."""
    total, inputs = 0.0, 3
    for name in LAYERS:
        count, outputs = len(levels.levels[int(name[4]) - 1].taps), CHANNELS[name]
        total += 4 * 9 * inputs * outputs * count + 4 * outputs**2 * count
        inputs = outputs
    return total


def product_rate() -> float:
    """Operations per second of a large bfloat16 matrix product."""
    a = torch.rand(4096, 4096).bfloat16()
    times = []
    for _ in range(4):
        start = time.perf_counter()
        torch.mm(a, a)
        times.append(time.perf_counter() - start)
    return 2 * 4096**3 / min(times)


def exponent(x: list[float], y: list[float]) -> float:
    """The slope of log y over log x."""
    return float(np.polyfit(np.log(x), np.log(y), 1)[0])


def show(results: list[Result], console: Console) -> None:
    """The table, and what follows from it."""
    table = Table(
        "faces", "side", "texels", "layout", "prepared", "paper", "step", "paper", "GF/s", "of products"
    )
    for r in results:
        paper = PREPARATION.get((r.faces, r.resolution), "")
        rate = r.operations / r.step
        share = f"{rate / 1e9:.0f}", f"{100 * rate / r.products:.0f} %"
        times = (
            f"{r.layout:.1f}",
            f"{r.prepared:.1f}",
            str(paper),
            f"{r.step:.2f}",
            str(STEP.get(r.resolution, "")),
        )
        table.add_row(f"{r.faces:,}", str(r.resolution), f"{r.texels:,}", *times, *share)
    console.print(table)
    products = [r.products / 1e9 for r in results]
    console.print(f"times in s; bfloat16 products {min(products):.0f} to {max(products):.0f} GF/s")
    console.print("goal: steps at 20 % of the products' rate, better 40 %")
    small = [r for r in results if r.faces == results[0].faces]
    if len(small) > 1:
        slope = exponent([r.texels for r in small], [r.prepared for r in small])
        console.print(f"preparing goes with texels^{slope:.2f}")
    last = [r for r in results if r.resolution == results[-1].resolution]
    if len(last) > 1:
        slope = exponent([r.faces for r in last], [r.prepared for r in last])
        console.print(f"preparing goes with faces^{slope:.2f} at {results[-1].resolution}^2")
    joined = ", ".join(f"{ratio:.2f}" for ratio in results[-1].joined)
    console.print(f"groups of the largest join {joined} elements (4 on a flat square)")
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9
    console.print(f"peak memory {peak:.2f} GB (goal: under 3 at 1024^2)")


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small sizes: shows that it runs, not how fast")
    options = parser.parse_args()
    keep_freed_memory()
    sizes = (32, 64) if options.quick else (256, 512, 1024)
    frequencies = (4, 8) if options.quick else (16, 100)
    results = [measure(icosphere(frequencies[0]), size, 1 if options.quick else 2) for size in sizes]
    results.append(measure(icosphere(frequencies[1]), sizes[-1], 1))
    assert all(math.isfinite(r.step) for r in results)
    show(results, Console(width=100))


if __name__ == "__main__":
    main()
