"""A paper-size MeshNCA training step, stage by stage, beside the ordinary way to compute it.

Run it as `python -m benchmarks.nca`: 40,962 vertices, 20 steps of the automaton, 6 whole views of 320 x 320,
albedo. The ordinary way is `benchmarks.naive`: messages along every edge, VGG-16 in float32, gathers, whole
cost matrices, all under autograd. Both run in one process on the same threads; every number is the best of
its repetitions.
"""

from __future__ import annotations

import argparse
import os
import resource
import time
from collections.abc import Callable
from dataclasses import dataclass, replace
from pathlib import Path

import torch
from rich.console import Console
from rich.table import Table

from benchmarks import naive
from mitex.exemplar import Exemplar
from mitex.features import normalise_colours
from mitex.losses import moment_distance, overflow_loss, relaxed_transport
from mitex.mesh import icosphere
from mitex.methods.nca import PRESETS, NcaConfig, NcaTexture
from mitex.methods.nca.decoder.decoder import OFFSET
from mitex.methods.nca.decoder.surface import Points
from mitex.methods.nca.model import FIRE_RATE
from mitex.methods.nca.surfaces import TrainingMesh
from mitex.methods.nca.task import NcaTask
from mitex.runtime.precision import bfloat16_flags
from mitex.scenes.cameras import Cameras
from mitex.scenes.stage import Visibility
from mitex.training.optim import Adam, gradient_norms, normalise_gradients

STEPS = 20
ALBEDO = slice(0, 3)  # channels of the albedo


@dataclass
class Row:
    """One line of the table; times in ms."""

    name: str
    mitex: float
    naive: float | None = None
    goal: str = ""


def best(function: Callable[[], object], repetitions: int) -> float:
    """Shortest time of several calls after one that warms up [ms]."""
    times = []
    for _ in range(repetitions + 1):
        start = time.perf_counter()
        function()
        times.append(time.perf_counter() - start)
    return 1e3 * min(times[1:])


class Bench:
    """A training task at the paper's size, and its parts with fixed inputs."""

    def __init__(self, config: NcaConfig, repetitions: int) -> None:
        self.repetitions = repetitions
        exemplar = Exemplar({"albedo": Exemplar.load("cobblestone").maps["albedo"]})
        self.task = NcaTask(config, exemplar)
        ((self.size, self.appearance),) = self.task.zooms.items()
        self.config, self.rule, self.network = config, self.task.look.rule, self.appearance.network
        self.sphere = TrainingMesh.of(icosphere(config.frequency), self.task.look)
        self.adam = Adam(self.task.parameters)
        generator = torch.Generator().manual_seed(0)
        self.task.pool.uniform_(-0.2, 0.2, generator=generator)  # as full of states as in a training
        self.task._touched.fill_(True)
        self.state = self.task.pool[:1].clone()
        cameras = self._cameras(generator)
        self.visibility, hits = self.sphere.stage.visibility(cameras), self.sphere.stage.hits(cameras)
        self.points = Points(hits.face, hits.barycentric)
        with torch.no_grad():
            self.images = self.sphere.views(self.task.look, self.state[0], cameras).contiguous()
        self.places, self.targets = self._targets(generator)
        with torch.no_grad():
            self.vectors = self.network.samples(self.images, self.places)
        self.upstream = {k: torch.randn(v.shape, generator=generator) for k, v in self.vectors.items()}
        self.plain, self.passing = naive.vgg_weights(), naive.MessagePassing.of(self.sphere.mesh)

    def _cameras(self, generator: torch.Generator) -> Cameras:
        return self.task.cameras(self.sphere, self.size, generator)

    def _targets(self, generator: torch.Generator) -> tuple[dict[str, torch.Tensor], dict[str, torch.Tensor]]:
        """Places to sample in the views, and as many vectors of the exemplar."""
        targets, count = self.appearance.targets, len(self.images)
        which = torch.zeros(count, dtype=torch.long)
        places, vectors = {}, {}
        for layer in self.config.layers:
            h, w = self.network.extent(layer, *self.images.shape[1:3])
            n = min(h * w, targets.size(layer), self.config.samples)
            places[layer] = torch.stack(
                [torch.randperm(h * w, generator=generator)[:n] for _ in range(count)]
            )
            there = torch.randint(targets.size(layer), (count, n), generator=generator)
            vectors[layer] = targets.sample(layer, which, there)
        there = torch.randint(targets.size("colour"), (count, self.config.samples), generator=generator)
        vectors["colour"] = targets.sample("colour", which, there)
        return places, vectors

    # The parts, by Mitex.

    def nca(self) -> None:
        generator = torch.Generator().manual_seed(1)
        state = self.rule.evolve(self.state, self.sphere.perception, STEPS, generator)
        torch.autograd.grad(state, self.task.parameters, torch.ones_like(state))

    def vgg(self) -> None:
        images = self.images.clone().requires_grad_()
        samples = self.network.samples(images, self.places)
        torch.autograd.grad(list(samples.values()), images, [self.upstream[k] for k in samples])

    def losses(self) -> None:
        low = self.network.dtype == torch.bfloat16
        vectors = {k: v.clone().requires_grad_() for k, v in self.vectors.items()}
        total = torch.zeros(())
        for layer, a in vectors.items():
            b = self.targets[layer]
            total = (
                total + relaxed_transport(a, b, low_precision=low).mean() + moment_distance(a, b, low).mean()
            )
        colours = self._colours().requires_grad_()
        b = normalise_colours(self.targets["colour"])
        total = total + relaxed_transport(normalise_colours(colours), b, euclidean=True).mean()
        total.backward()

    def visible(self) -> None:
        self.sphere.stage.hits(self._cameras(torch.Generator().manual_seed(2)))

    def lookup(self) -> None:
        state, surface = self.state[0].clone().requires_grad_(), self.sphere.surface
        values = self.task.look.decoder(surface, surface.table(state), self.points)
        torch.autograd.grad(values, state, torch.ones_like(values))

    def step(self) -> None:
        self.adam.clear()
        step = self.task.loss(1, torch.Generator().manual_seed(3))
        step.value.backward()
        self._update()
        step.commit()

    # The same by the ordinary ways.

    def naive_nca(self) -> None:
        state = self._naive_evolve(self.state, torch.Generator().manual_seed(1))
        torch.autograd.grad(state, self.task.parameters, torch.ones_like(state))

    def naive_vgg(self) -> None:
        images = self.images.clone().requires_grad_()
        samples = naive.vectors(naive.vgg(images, self.plain), self.places)
        torch.autograd.grad(list(samples.values()), images, [self.upstream[k] for k in samples])

    def naive_losses(self) -> None:
        vectors = {k: v.clone().requires_grad_() for k, v in self.vectors.items()}
        self._naive_loss(vectors, self._colours().requires_grad_()).backward()

    def naive_lookup(self) -> None:
        state = self.state[0].clone().requires_grad_()
        images = self._naive_lookup(state, self.visibility)
        torch.autograd.grad(images, state, torch.ones_like(images))

    def naive_step(self) -> None:
        self.adam.clear()
        generator = torch.Generator().manual_seed(3)
        state = self._naive_evolve(self.task.pool[:1].clone(), generator)
        images = self._naive_lookup(state[0], self.sphere.stage.visibility(self._cameras(generator)))
        vectors = naive.vectors(naive.vgg(images, self.plain), self.places)
        loss = self._naive_loss(vectors, images.flatten(1, 2)[:, : self.config.samples])
        (loss + self.config.overflow_weight * overflow_loss(state)).backward()
        self._update()

    def _naive_evolve(self, state: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
        for _ in range(STEPS):
            mask = torch.rand(state.shape[:2], generator=generator) < FIRE_RATE
            state = self.passing.step(self.rule, state, mask)
        return state

    @staticmethod
    def _naive_lookup(state: torch.Tensor, visibility: Visibility) -> torch.Tensor:
        return naive.lookup(state[:, ALBEDO] + OFFSET, visibility)

    def _naive_loss(self, vectors: dict[str, torch.Tensor], colours: torch.Tensor) -> torch.Tensor:
        b = normalise_colours(self.targets["colour"])
        total = naive.relaxed_transport(normalise_colours(colours), b, euclidean=True).mean()
        for layer, a in vectors.items():
            b = self.targets[layer]
            total = total + (naive.relaxed_transport(a, b) + naive.moment_distance(a, b)).mean()
        return total

    def _colours(self) -> torch.Tensor:
        return self.images.flatten(1, 2)[:, : self.config.samples].clone()

    def _update(self) -> None:
        normalise_gradients(self.adam.parameters, gradient_norms(self.adam.parameters))
        self.adam.step(1e-9)  # so small that all repetitions compute the same

    def check(self) -> None:
        """Both ways compute the same: the gradients of the automaton, and the views."""
        upstream = torch.randn(self.state.shape, generator=torch.Generator().manual_seed(5))
        ours = self.rule.evolve(self.state, self.sphere.perception, 3, torch.Generator().manual_seed(1))
        generator, theirs = torch.Generator().manual_seed(1), self.state
        for _ in range(3):
            mask = torch.rand(theirs.shape[:2], generator=generator) < FIRE_RATE
            theirs = self.passing.step(self.rule, theirs, mask)
        for a, b in zip(
            *(torch.autograd.grad(x, self.task.parameters, upstream) for x in (ours, theirs)), strict=True
        ):
            assert (a - b).norm() < 1e-3 * b.norm()
        with torch.no_grad():
            assert torch.allclose(self.images, self._naive_lookup(self.state[0], self.visibility), atol=1e-5)

    def time(self, function: Callable[[], object]) -> float:
        return best(function, self.repetitions)


def apply_step(frequency: int, repetitions: int) -> float:
    """One step of the automaton without gradients [ms], averaged over fifty."""
    mesh, texture = icosphere(frequency), NcaTexture.load("cobblestone")
    return best(lambda: texture.grow(mesh, steps=50), repetitions) / 50


def peak_memory() -> float:
    """Largest resident memory of this process so far [GB]."""
    return resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024 / 1e9


def cpu() -> str:
    """Name, cores, load, and what the CPU has for bfloat16."""
    try:
        lines = Path("/proc/cpuinfo").read_text().splitlines()
    except OSError:
        lines = []
    name = next((line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")), "CPU")
    flags = ", ".join(bfloat16_flags()) or "no bfloat16 instructions"
    use = f"{torch.get_num_threads()} threads, load {os.getloadavg()[0]:.1f}"
    return f"{name}, {os.cpu_count()} cores ({flags}), {use}"


def measure(bench: Bench, apply_frequency: int) -> tuple[list[Row], float]:
    """All rows, and the peak memory [GB] of what a training does, before the naive parts run."""
    parts = [
        Row("NCA, 20 steps", bench.time(bench.nca), goal=">= 6 x"),
        Row("VGG-16", bench.time(bench.vgg), goal=">= 4 x"),
        Row("transport + moments", bench.time(bench.losses)),
        Row("visibility", bench.time(bench.visible)),
        Row("lookup + adjoint", bench.time(bench.lookup)),
        Row("whole training step", bench.time(bench.step), goal=">= 4 x, <= 2500 (AMX)"),
    ]
    bench.task.state()  # what a checkpoint copies
    memory = peak_memory()
    applied = Row(f"apply, a step at {10 * apply_frequency**2 + 2:,} vertices", 0.0, goal="<= 3 ms")
    applied.mitex = apply_step(apply_frequency, bench.repetitions)
    bench.check()
    ways = (bench.naive_nca, bench.naive_vgg, bench.naive_losses, None, bench.naive_lookup, bench.naive_step)
    for row, way in zip(parts, ways, strict=True):
        row.naive = None if way is None else bench.time(way)
    return [*parts, applied], memory


def show(rows: list[Row], memory: float, console: Console) -> None:
    """Prints the table and what follows from it."""
    table = Table("forward + backward", "Mitex [ms]", "naive [ms]", "ratio", "goal")
    for column in table.columns[1:4]:
        column.justify = "right"
    for row in rows:
        ratio = "" if row.naive is None else f"{row.naive / row.mitex:.1f} x"
        other = "" if row.naive is None else f"{row.naive:.0f}"
        table.add_row(row.name, f"{row.mitex:.1f}", other, ratio, row.goal)
    console.print(table)
    rendering = 100 * (rows[3].mitex + rows[4].mitex) / rows[5].mitex
    console.print(f"rendering is {rendering:.1f} % of the step (goal: 10 %)")
    console.print(
        f"peak memory of the training {memory:.2f} GB (goal: under 6), with the naive way {peak_memory():.2f}"
    )


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small sizes: shows that it runs, not how fast")
    parser.add_argument("--repetitions", type=int, default=3, help="after one that warms up")
    options = parser.parse_args()
    # A small gain: with the preset's, states of an untrained rule grow without bound over the repetitions.
    config = replace(PRESETS["paper"], steps=1, min_steps=STEPS, max_steps=STEPS, gain=0.1)
    if options.quick:
        config = replace(config, frequency=12, pool=4, view_count=2, resolution=64, target_size=64)
        options.repetitions = 1
    console = Console()
    console.print(cpu())
    bench = Bench(config, options.repetitions)
    vertices, views = len(bench.sphere.mesh.vertices), f"{config.view_count} views of {config.resolution}^2"
    console.print(f"{vertices:,} vertices, {views} pixels, VGG-16 in {bench.network.dtype}")
    show(*measure(bench, 8 if options.quick else 32), console)


if __name__ == "__main__":
    main()
