"""Training steps of MeshNCA from words, with their parts: by CLIP, and by the small embedded model.

Run it as `python -m benchmarks.nca_text`. CLIP is a ViT-B/32 with random weights, on which its speed does not
depend; its image tower is measured in both precisions. All runs in one process on the same threads; every
number is the best of its repetitions.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable, Mapping, Sequence
from dataclasses import replace
from functools import partial

import torch
from rich.console import Console
from rich.table import Table

from benchmarks.nca import best, cpu
from mitex.features.clip.shape import ClipShape, TowerShape
from mitex.features.clip.towers import ImageTower, Linear
from mitex.features.text_image import TextImageModel
from mitex.features.words import words_model
from mitex.methods.nca import PRESETS, NcaConfig
from mitex.methods.nca.text.task import TextTask
from mitex.runtime import let_idle_threads_sleep

TEXT = TowerShape(512, 12, 8, 2048)
B32 = ClipShape(TowerShape(768, 12, 12, 3072), TEXT, 512, 224, 32, 49408, 77, 49407)
TINY = ClipShape(TowerShape(64, 2, 4, 128), TEXT, 512, 224, 32, 49408, 77, 49407)
DTYPES = (torch.float32, torch.bfloat16)


class RandomTower:
    """A vision-language model without sense."""

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
    """The parts of a step, with the same sight and state.

    Args:
        config: of the training.
        model: that looks.
    """

    def __init__(self, config: NcaConfig, model: TextImageModel) -> None:
        self.config = replace(config, text="red dots on white", surfaces=("even",), text_bank=1)
        self.model, self.task = model, TextTask(self.config, model)
        (self.sphere,) = self.task.meshes
        self.state = 0.2 * torch.randn(self.task.pool.shape[1:], generator=torch.Generator().manual_seed(0))
        self.task.pool[:] = self.state
        self.task.banks[self.sphere].negative(0)

    def pictures(self) -> torch.Tensor:
        """As many as the model sees in a step."""
        weights = self.config.text_whole_weight, self.config.text_close_weight, self.config.text_relief_weight
        squares = (1, self.config.text_crops, self.config.text_crops)
        each = sum(count for weight, count in zip(weights, squares, strict=True) if weight)
        side = self.model.resolution
        return torch.rand(self.config.view_count * each, side, side, 3, requires_grad=True)

    def rollout(self) -> None:
        steps = self.config.max_steps
        result = self.task.evolved(0, self.task.grown(0), steps, torch.Generator().manual_seed(0))
        torch.autograd.grad(result.sum(), list(self.task.look.rule.parameters()))

    def views(self) -> None:
        state = self.state.clone().requires_grad_()
        views = self.task.figures[self.sphere].textured(
            self.task.look, state, self.task.banks[self.sphere].sight(0).cameras
        )
        torch.autograd.grad((views.coloured + views.plain).sum(), state)

    def step(self) -> None:
        loss = self.task.loss(1, torch.Generator().manual_seed(0)).value
        torch.autograd.grad(loss, self.task.parameters)

    def parts(self, models: Mapping[str, TextImageModel]) -> Mapping[str, Callable[[], object]]:
        """What is measured, by name; `models` are to look at the pictures of a step alone."""
        pictures = self.pictures()

        def look(model: TextImageModel) -> None:
            torch.autograd.grad(model.encode_images(pictures).sin().sum(), pictures)

        looks = {f"{name}, {len(pictures)} pictures": partial(look, model) for name, model in models.items()}
        first = {f"automaton, {self.config.max_steps} steps": self.rollout, "views with a relief": self.views}
        return first | looks | {"whole step": self.step}


def small(config: NcaConfig) -> NcaConfig:
    """A training in which everything happens, and quickly."""
    return replace(config, frequency=12, pool=2, resolution=64, view_count=1, text_crops=1)


def main() -> None:
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--quick", action="store_true", help="small sizes: shows that it runs, not how fast")
    quick = parser.parse_args().quick
    let_idle_threads_sleep()
    clip = {str(dtype)[6:]: RandomTower(TINY if quick else B32, dtype) for dtype in DTYPES}
    towers = {f"image tower, {name}": tower for name, tower in clip.items()}
    trainings: Mapping[str, Mapping[str, TextImageModel]] = {
        "text": towers,
        "text-words": {"model": words_model()},
    }
    titles = {"text": "a ViT-B/32 (steps in bfloat16)", "text-words": "the embedded model"}
    Console().print(cpu())
    for preset, models in trainings.items():
        config = small(PRESETS[preset]) if quick else PRESETS[preset]
        words = Words(config, list(models.values())[-1])
        table = Table(f"preset `{preset}` with {titles[preset]}, forward + backward", "ms")
        for name, part in words.parts(models).items():
            table.add_row(name, f"{best(part, 1 if quick else 3):.0f}")
        Console().print(table)


if __name__ == "__main__":
    main()
