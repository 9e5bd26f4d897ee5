"""A training step of MeshNCA's default preset, stage by stage, and what it takes to put a model on a mesh.

Run it as `python -m benchmarks.nca_decoder`. The ordinary way to bake is plain torch: states gathered at the
corners of every texel's face and interpolated linearly, then linear layers and sines, on all texels at once.
All runs in one process on the same threads; every number is the best of its repetitions.
"""

from __future__ import annotations

import argparse
import time
from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
import torch.nn.functional as F
from rich.console import Console
from rich.table import Table

from benchmarks.nca import best, cpu
from mitex.atlas import Atlas, laid_out
from mitex.exemplar import Exemplar
from mitex.mesh import Mesh, embedded
from mitex.methods.nca import PRESETS, NcaTexture
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.decoder import OFFSET, Decoder
from mitex.methods.nca.decoder.surface import Points, Surface
from mitex.methods.nca.task import NcaTask
from mitex.runtime import let_idle_threads_sleep

MODEL, MESH = "cobblestone", "vase"
ROLLOUT = 36  # steps of the automaton, the mean of the preset's


class Training:
    """The stages of a step, each forward and backward, with fixed inputs.

    Args:
        quick: at a small size.
    """

    def __init__(self, quick: bool) -> None:
        config = replace(PRESETS["patch"], min_steps=ROLLOUT, max_steps=ROLLOUT, surfaces=("even",))
        if quick:
            config = replace(config, frequency=12, pool=2, resolution=32, view_count=1, exemplar_size=128)
        self.task = NcaTask(config, Exemplar.load(MODEL), NcaTexture.load(MODEL).look)
        (self.surface,) = self.task.surfaces
        self.state = self.task.grown(0)
        self.images = {size: self._views(size).detach() for size in self.task.zooms}

    def _views(self, size: int) -> torch.Tensor:
        generator = torch.Generator().manual_seed(size)
        return self.task.views(self.surface, self.state[0], size, generator)

    def automaton(self) -> None:
        generator = torch.Generator().manual_seed(0)
        state = self.task.look.rule.evolve(self.state, self.surface.perception, ROLLOUT, generator)
        torch.autograd.grad(state.sum(), list(self.task.look.rule.parameters()))

    def decoder(self) -> None:
        for size in self.task.zooms:
            torch.autograd.grad(self._views(size).sum(), list(self.task.look.decoder.parameters()))

    def appearance(self) -> None:
        for size, appearance in self.task.zooms.items():
            images = self.images[size].clone().requires_grad_()
            appearance(images, torch.Generator().manual_seed(0)).backward()

    def step(self) -> None:
        value = self.task.loss(1, torch.Generator().manual_seed(0)).value
        torch.autograd.grad(value, self.task.parameters)


class Baking:
    """A grown state on a mesh with UVs, and its maps."""

    def __init__(self) -> None:
        self.texture, self.mesh = NcaTexture.load(MODEL), laid_out(embedded(MESH), 1024)
        self.cells = Cells.of(self.mesh)
        self.state = self.texture.grow(self.cells.mesh)
        self.grown = GrownTexture(self.texture.look, self.state, self.cells)

    def atlas(self, resolution: int) -> Atlas:
        return Atlas.build(self.mesh, resolution, 8, self.mesh.uv)

    def decode(self, atlas: Atlas) -> None:
        for rows in atlas.strips():
            used = atlas.face[rows] >= 0
            self.grown.values(atlas.face[rows][used], atlas.barycentric[rows][used].clip(0))

    def ordinary(self, atlas: Atlas) -> None:
        used = atlas.face >= 0
        face, barycentric = self.cells.locate(atlas.face[used], atlas.barycentric[used].clip(0))
        plain_decoder(self.texture, self.state, self.cells.mesh, face, barycentric)


def plain_decoder(
    texture: NcaTexture, state: torch.Tensor, mesh: Mesh, face: np.ndarray, barycentric: np.ndarray
) -> torch.Tensor:
    """Values (P, K) at points of a mesh, of linearly interpolated states, by plain torch."""
    decoder = texture.look.decoder
    assert isinstance(decoder, Decoder)
    corners = state[torch.from_numpy(mesh.faces[face].astype(np.int64))]
    x = (torch.from_numpy(barycentric)[:, :, None] * corners).sum(1)
    place = Surface(mesh, "linear").place(Points(torch.from_numpy(face), torch.from_numpy(barycentric)))
    x = torch.cat([x, decoder.waves(*place)], 1)
    *hidden, last = decoder.network.linear
    for layer in hidden:
        x = torch.sin(decoder.network.omega * F.linear(x, layer.weight, layer.bias))
    return F.linear(x, last.weight, last.bias) + OFFSET


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small sizes: shows that it runs, not how fast")
    options = parser.parse_args()
    let_idle_threads_sleep()
    repetitions = 1 if options.quick else 3
    console = Console()
    console.print(cpu())
    console.print(training_table(Training(options.quick), repetitions))
    console.print(baking_table(Baking(), (256,) if options.quick else (1024, 2048, 4096, 8192), repetitions))


def training_table(training: Training, repetitions: int) -> Table:
    """The stages of a training step."""
    views = sum(len(images) for images in training.images.values())
    table = Table(f"preset `patch`, {views} views, forward + backward", "ms", "share, %")
    stages: dict[str, Callable[[], object]] = {
        f"automaton, {ROLLOUT} steps, {training.surface.perception.vertices:,} cells": training.automaton,
        "views: visibility, interpolation, decoder": training.decoder,
        "VGG-16, transport, order": training.appearance,
        "whole step": training.step,
    }
    times = {name: best(stage, repetitions) for name, stage in stages.items()}
    for name, milliseconds in times.items():
        table.add_row(name, f"{milliseconds:.0f}", f"{100 * milliseconds / times['whole step']:.0f}")
    return table


def baking_table(baking: Baking, resolutions: tuple[int, ...], repetitions: int) -> Table:
    """Five maps of a mesh: the layout's texels, the decoder beside the ordinary way, and all of `apply`."""
    table = Table(f"five maps, {len(baking.mesh.faces):,} faces", "texels, s", "decoder, s", "ordinary, s")
    table.add_column("ratio")
    table.add_column("apply, s")
    for resolution in resolutions:
        start = time.perf_counter()
        atlas = baking.atlas(resolution)
        texels = time.perf_counter() - start
        decoder = best(lambda atlas=atlas: baking.decode(atlas), repetitions) / 1e3
        plain, ratio = "", ""
        if resolution <= 4096:  # more would not fit into the memory
            ordinary = best(lambda atlas=atlas: baking.ordinary(atlas), 1) / 1e3
            plain, ratio = f"{ordinary:.2f}", f"{ordinary / decoder:.1f} x"
        start = time.perf_counter()
        baking.texture.apply(baking.mesh, resolution=resolution)
        applied = time.perf_counter() - start
        cells = [f"{texels:.2f}", f"{decoder:.2f}", plain, ratio, f"{applied:.1f}"]
        table.add_row(f"{resolution} x {resolution}", *cells)
    return table


if __name__ == "__main__":
    main()
