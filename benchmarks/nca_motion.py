"""What motion adds to a training step of MeshNCA, by each way to measure it, and to a growing texture.

Run it as `python -m benchmarks.nca_motion`. First come the states of one rollout on a sphere of 10,242 cells,
and what tells how far they are from moving along a field, forward and backward. The transport residual looks
at all of them, the others at pictures of the last two. Then come steps of a finished automaton on spheres of
10,242 and of 40,962 cells: without a field, told of one, and carried along it. All runs in one process on the
same threads; every number is the best of its repetitions.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import replace

import torch
from rich.console import Console
from rich.table import Table

from benchmarks.nca import best, cpu
from mitex.exemplar import Exemplar
from mitex.features.flow import load_estimator
from mitex.mesh import icosphere
from mitex.methods.nca import PRESETS, NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.growth import LookGrowth
from mitex.methods.nca.motion.cell_motion import STILL, look_motion
from mitex.methods.nca.motion.start import with_condition
from mitex.methods.nca.motion.tangent_field import TangentField, random_field
from mitex.methods.nca.motion.task import MotionTask
from mitex.runtime import let_idle_threads_sleep

MODEL = "lava"
ESTIMATORS = ("advection", "lucas-kanade", "flow")
FREQUENCIES = (32, 64)  # of the spheres that textures grow on
GROWTH = 50  # steps
WAYS = ("still", "told", "carried")  # of a field


class Motion:
    """The parts of a step, each with the same field and states.

    Args:
        quick: at a small size.
    """

    def __init__(self, quick: bool) -> None:
        config = replace(PRESETS["motion"], surfaces=("even",), min_steps=40, max_steps=40)
        if quick:
            config = replace(config, frequency=12, pool=2, resolution=32, view_count=1, exemplar_size=128)
        self.task = MotionTask(config, Exemplar.load(MODEL), with_condition(NcaTexture.load(MODEL).look))
        (self.surface,) = self.task.surfaces
        self.task.pool.copy_(0.2 * torch.randn(self.task.pool.shape, generator=self._generator()))
        self.field = self.draw()
        self.states = [state.requires_grad_() for state in self._states()]
        self.estimators = {n: None if n == "advection" else load_estimator(n) for n in ESTIMATORS}

    @staticmethod
    def _generator() -> torch.Generator:
        return torch.Generator().manual_seed(0)

    def _states(self) -> list[torch.Tensor]:
        count = self.task.config.min_steps // self.task.config.motion_steps + 1
        return [self.task.grown(0)[0] + 0.01 * k for k in range(count)]

    def draw(self) -> TangentField:
        return random_field(self.task.config, self.surface, self._generator())

    def rollout(self) -> None:
        result = self.task.evolved(0, self.task.grown(0), self.task.config.min_steps, self._generator())
        torch.autograd.grad(result.sum(), list(self.task.look.rule.parameters()))

    def loss(self, name: str) -> None:
        task, apart = self.task, self.task.config.motion_steps
        task.estimator = self.estimators[name]
        if task.estimator:
            value = task.picture_loss(self.states, task.motion_views(self.field, self._generator()), apart)
        else:
            value = task.state_residual(self.states, self.field, apart, self._generator())
        torch.autograd.grad(value, self.states[-1])

    def step(self) -> None:
        self.task.estimator = self.estimators[self.task.config.motion_estimator]
        torch.autograd.grad(self.task.loss(1, self._generator()).value, self.task.parameters)


def steps_per_second(frequency: int, way: str, repetitions: int) -> float:
    """Of a finished automaton on a sphere that is still, told of a field, or carried along it."""
    look = NcaTexture.load(MODEL).look
    look = with_condition(look) if way == "told" else look
    mesh = icosphere(frequency)
    cells, generator = Cells.of(mesh, 0), torch.Generator().manual_seed(0)
    motion = STILL if way == "still" else look_motion(look, {}, mesh, mesh, "right", 1.0)
    growth = LookGrowth(look, cells, motion=motion)
    state = growth.evolve(growth.seed(), 1, generator)
    return 1e3 * GROWTH / best(lambda: growth.evolve(state, GROWTH, generator), repetitions)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small sizes: shows that it runs, not how fast")
    options = parser.parse_args()
    let_idle_threads_sleep()
    motion, repetitions = Motion(options.quick), 1 if options.quick else 3
    steps, cells = motion.task.config.min_steps, motion.surface.perception.vertices
    parts: dict[str, Callable[[], object]] = {
        f"automaton, {steps} steps, {cells:,} cells": motion.rollout,
        "a field, turned at random": motion.draw,
    }
    parts |= {f"motion by {name}": lambda name=name: motion.loss(name) for name in ESTIMATORS}
    parts["whole step"] = motion.step
    times = {name: best(part, repetitions) for name, part in parts.items()}
    table = Table("preset `motion`, forward + backward", "ms", "share, %")
    for name, milliseconds in times.items():
        table.add_row(name, f"{milliseconds:.0f}", f"{100 * milliseconds / list(times.values())[-1]:.0f}")
    growth = Table("cells", *(f"steps/s, {way}" for way in WAYS))
    for frequency in (8,) if options.quick else FREQUENCIES:
        rates = [steps_per_second(frequency, way, repetitions) for way in WAYS]
        growth.add_row(f"{10 * frequency**2 + 2:,}", *(f"{rate:.0f}" for rate in rates))
    Console().print(cpu(), table, growth)


if __name__ == "__main__":
    main()
