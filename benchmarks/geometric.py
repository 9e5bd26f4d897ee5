"""How fast geometric textures are learned and applied.

usage: python -m benchmarks.geometric [--quick]

For each level a step of the training (the generator's, with the critic's turns), with the factored face
convolutions and, in the same run, with naive ones; what both presets take by that; growing a texture on a
mesh of 20,000 faces, and placing bumps there, as densely as knobs. The paper names 118 minutes of training on
a GPU.
"""

from __future__ import annotations

import argparse
import time
from dataclasses import replace
from unittest.mock import patch

import torch
from rich.console import Console
from rich.table import Table

from benchmarks.naive import face_network
from mitex.mesh import icosphere
from mitex.methods.geometric.config import PRESETS, GeometricConfig
from mitex.methods.geometric.hierarchy import Hierarchy
from mitex.methods.geometric.network import FaceNetwork
from mitex.methods.geometric.placement import Bumps, placed
from mitex.methods.geometric.task import GeometricTask
from mitex.methods.geometric.texture import GeometricTexture
from mitex.runtime import keep_freed_memory

KNOBS = Bumps(9.0, 1.0)  # about those of the trained knobs on level 2
TURN = 3  # steps after which the critic's turns repeat
ENOUGH = 1.0  # seconds of steps that are timed


def step_seconds(task: GeometricTask, level: int) -> float:
    """Of one step of a level, on average over whole turns."""
    generator = torch.Generator().manual_seed(0)
    first = level * task.config.level_steps

    def turn(first_step: int) -> None:
        for step in range(first_step, first_step + TURN):
            task.begin(step, generator)
            torch.autograd.grad(task.loss(step, generator).value, task.generators[level].parameters)

    turn(first)
    start, turns = time.perf_counter(), 0
    while not turns or time.perf_counter() - start < ENOUGH:
        turns += 1
        turn(first + TURN)
    return (time.perf_counter() - start) / (turns * TURN)


def toy(levels: int) -> GeometricTask:
    """A task of the right sizes: what is learned makes no difference to the time."""
    config = GeometricConfig(steps=levels * 2_000, level_steps=2_000)
    ball = icosphere(1)
    hierarchy = Hierarchy.of(ball, levels)
    generator = torch.Generator().manual_seed(0)
    meshes = [
        torch.tensor(mesh.vertices) * 2**k + 0.1 * torch.randn(len(mesh.vertices), 3, generator=generator)
        for k, mesh in enumerate(hierarchy.meshes)
    ]
    return GeometricTask(config, hierarchy, torch.tensor(ball.vertices), meshes, ball, {})


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    parser.add_argument("--quick", action="store_true", help="levels 0 to 3")
    levels = 4 if parser.parse_args().quick else 6
    keep_freed_memory()
    task, console = toy(levels), Console(width=100)
    table = Table("level", "faces", "step", "naive", "factor", "fast, so far", "paper, so far")
    total = 0.0
    for level in range(levels):
        seconds = step_seconds(task, level)
        with patch.object(FaceNetwork, "__call__", face_network):
            naive = step_seconds(task, level)
        total += seconds
        minutes = [total * PRESETS[name].level_steps / 60 for name in ("fast", "paper")]
        cells = [
            f"{seconds:.3f} s",
            f"{naive:.3f} s",
            f"{naive / seconds:.2f}",
            *(f"{m:.0f} min" for m in minutes),
        ]
        table.add_row(str(level), f"{len(task.hierarchy.graphs[level]):,}", *cells)
    console.print(table)
    mesh = icosphere(32)
    texture = GeometricTexture(
        task.generators[:levels], icosphere(1), task.fixed, {"noise": 0.1, "remeasure": False}
    )
    start = time.perf_counter()
    grown = texture.apply(replace(mesh, name="ball"), end_level=min(4, levels - 1)).mesh
    console.print(
        f"applied to {len(mesh.faces):,} faces, {len(grown.faces):,} at the end: "
        f"{time.perf_counter() - start:.1f} s"
    )
    start = time.perf_counter()
    placed(mesh, KNOBS, 0)
    console.print(f"bumps placed on them: {time.perf_counter() - start:.2f} s")


if __name__ == "__main__":
    main()
