"""A training step of MeshNCA from words, with its parts, and the image tower of CLIP in both precisions.

Run it as `python -m benchmarks.nca_text`. The tower is a ViT-B/32 with random weights, on which its speed
does not depend. All runs in one process on the same threads; every number is the best of its repetitions.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Sequence
from dataclasses import replace

import torch
from rich.console import Console
from rich.table import Table

from benchmarks.nca import best, cpu
from mitex.features.clip.shape import ClipShape, TowerShape
from mitex.features.clip.towers import ImageTower, Linear
from mitex.methods.nca import PRESETS
from mitex.methods.nca.text.task import TextTask
from mitex.runtime import let_idle_threads_sleep

TEXT = TowerShape(512, 12, 8, 2048)
B32 = ClipShape(TowerShape(768, 12, 12, 3072), TEXT, 512, 224, 32, 49408, 77, 49407)
TINY = ClipShape(TowerShape(64, 2, 4, 128), TEXT, 512, 224, 32, 49408, 77, 49407)


class RandomTower:
    """A model of texts and images without sense."""

    name = "random weights"

    def __init__(self, shape: ClipShape, dtype: torch.dtype) -> None:
        self.resolution = shape.resolution
        self.tower, self.width = ImageTower(shape).requires_grad_(False), shape.image.width
        for layer in self.tower.modules():
            if isinstance(layer, Linear):
                layer.to(dtype)

    def encode_images(self, images: torch.Tensor) -> torch.Tensor:
        return self.tower(images.permute(0, 3, 1, 2))

    def encode_texts(self, texts: Sequence[str]) -> torch.Tensor:
        return torch.randn(len(texts), self.width, generator=torch.Generator().manual_seed(0))


class Words:
    """The parts of a step, with the same sight and state."""

    def __init__(self, quick: bool) -> None:
        config = replace(PRESETS["text"], text="red dots on white", surfaces=("even",), text_bank=1)
        if quick:
            config = replace(config, frequency=12, pool=2, resolution=64, view_count=1, text_crops=1)
        shape = TINY if quick else B32
        self.models = {dtype: RandomTower(shape, dtype) for dtype in (torch.float32, torch.bfloat16)}
        self.task = TextTask(config, self.models[torch.bfloat16])
        (self.sphere,) = self.task.spheres
        self.state = 0.2 * torch.randn(self.task.pool.shape[1:], generator=torch.Generator().manual_seed(0))
        self.task.pool[:] = self.state
        self.task.banks[self.sphere].negative(0)
        count = config.view_count * (1 + 2 * config.text_crops)
        self.images = torch.rand(count, 224, 224, 3, requires_grad=True)

    def rollout(self) -> None:
        steps = self.task.config.max_steps
        result = self.task.evolved(0, self.task.grown(0), steps, torch.Generator().manual_seed(0))
        torch.autograd.grad(result.sum(), list(self.task.look.rule.parameters()))

    def views(self) -> None:
        state = self.state.clone().requires_grad_()
        views = self.task.figures[self.sphere].textured(
            self.task.look, state, self.task.banks[self.sphere].sight(0).cameras
        )
        torch.autograd.grad((views.coloured + views.plain).sum(), state)

    def tower(self, dtype: torch.dtype) -> None:
        torch.autograd.grad(self.models[dtype].encode_images(self.images).sin().sum(), self.images)

    def step(self) -> None:
        loss = self.task.loss(1, torch.Generator().manual_seed(0)).value
        torch.autograd.grad(loss, self.task.parameters)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small sizes: shows that it runs, not how fast")
    options = parser.parse_args()
    let_idle_threads_sleep()
    words, repetitions = Words(options.quick), 1 if options.quick else 3
    parts: dict[str, Callable[[], object]] = {
        f"automaton, {words.task.config.max_steps} steps": words.rollout,
        "views with a relief": words.views,
        f"image tower, {len(words.images)} pictures, float32": lambda: words.tower(torch.float32),
        "the same, bfloat16": lambda: words.tower(torch.bfloat16),
        "whole step, bfloat16": words.step,
    }
    table = Table("preset `text` with a ViT-B/32, forward + backward", "ms")
    for name, part in parts.items():
        table.add_row(name, f"{best(part, repetitions):.0f}")
    Console().print(cpu(), table)


if __name__ == "__main__":
    main()
