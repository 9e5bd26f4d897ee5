"""How fast motion between frames is estimated, with the gradient in the frames.

usage: python -m benchmarks.flow [--quick]

Six pairs of frames of 128 x 128 pixels, as in a training step of a moving texture: the flow network as it
ships (frozen, channels last), the same layers as torch makes them (every gradient, float32), and Lucas and
Kanade's method. All in one process; every number is the best of several.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable

import torch
from rich.console import Console
from rich.table import Table

from benchmarks.nca import best, cpu
from mitex.features.flow import FlowNetwork, flow_network, lucas_kanade
from mitex.runtime import keep_freed_memory

Estimate = Callable[[torch.Tensor], torch.Tensor]


def ordinary(network: FlowNetwork) -> FlowNetwork:
    """The same weights in a network that could be trained."""
    copy = FlowNetwork()
    copy.load_state_dict(network.state_dict())
    return copy


def backward(estimate: Estimate, pairs: torch.Tensor) -> torch.Tensor:
    """The gradient of half the squared motion."""
    pairs = pairs.clone().requires_grad_()
    motion = estimate(pairs)
    motion.backward(motion.detach())
    assert pairs.grad is not None
    return pairs.grad


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="one small pair: shows that it runs")
    quick = parser.parse_args().quick
    keep_freed_memory()
    count, side, repetitions = (1, 48, 1) if quick else (6, 128, 5)
    pairs = torch.rand(count, 2, side, side, generator=torch.Generator().manual_seed(0))
    network = flow_network()
    estimates: dict[str, Estimate] = {
        "flow network": network,
        "the same, not frozen": ordinary(network),
        "Lucas-Kanade": lambda pairs: lucas_kanade(pairs[:, :1], pairs[:, 1:]),
    }
    ours, theirs = (backward(estimates[name], pairs) for name in list(estimates)[:2])
    assert (ours - theirs).norm() < 1e-3 * theirs.norm()
    table = Table(f"{count} pairs of {side} x {side}", "forward [ms]", "forward + backward [ms]")
    for name, estimate in estimates.items():

        def forward(estimate: Estimate = estimate) -> None:
            with torch.no_grad():
                estimate(pairs)

        both = best(lambda estimate=estimate: backward(estimate, pairs), repetitions)
        table.add_row(name, f"{best(forward, repetitions):.0f}", f"{both:.0f}")
    console = Console(width=100)
    console.print(cpu())
    console.print(table)
    console.print("goal: forward and backward within 1000 ms")


if __name__ == "__main__":
    main()
