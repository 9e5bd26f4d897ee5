"""Measures how a relief from words is best learned: through shading normals, or through geometry that moves.

usage: python tools/compare_reliefs.py steps MODEL [--whole]
       python tools/compare_reliefs.py train WAY OUT [--text WORDS] [--minutes X] [--whole]

The WAYs are `normals`, as `mitex fit nca`, and `geometry`, which shows the colours of the vertices, linear
between them; `vertices` shows such colours too, and shades by normals.

`steps` lets a texture of `mitex fit nca --text` grow, and compares what the embedded model sees of it with
its text both ways. It prints the time of a step and of the views in it, and the cosine of both gradients in
the heights; then the gradient of the geometry along itself, and the same by finite differences.
`train` is the training of `mitex fit nca --text` for so many minutes of a processor, whatever its number of
steps; its learning rate falls after the same shares of them. It prints the steps and the peak of memory, and
writes a texture. Settings are those of the preset `text-words`, which sees close-ups without outlines; with
--whole, surface and views are those of `text`: whole views, and close-ups of them in colour and in grey.
"""

from __future__ import annotations

import argparse
import resource
import time
import timeit
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import torch
from moved_figure import MovedFigure

from mitex.features.words import words_model
from mitex.methods.nca import PRESETS, NcaConfig, NcaTexture
from mitex.methods.nca.look import Look
from mitex.methods.nca.text.task import TextTask
from mitex.methods.nca.text.views import Figure, Views
from mitex.runtime import let_idle_threads_sleep
from mitex.scenes.cameras import Cameras
from mitex.scenes.shaded import GREY, pictured
from mitex.sparse import Weights
from mitex.training.state import TrainState

FALLS = (0.6, 0.85)  # shares of a training after which its learning rate falls, as in the preset
WHOLE = (
    *("frequency", "min_steps", "max_steps", "views", "view_count", "resolution", "text_distances"),
    *("text_tilt", "text_close_weight", "text_relief_weight"),
)
REPETITIONS = 10
STEP = 0.02  # of finite differences, as a length of the V heights


class VertexFigure(Figure):
    """The pictures of a `Figure`, with the colours of the vertices, linear between them."""

    def textured(self, look: Look, state: torch.Tensor, cameras: Cameras) -> Views:
        hit, points = self._visible(cameras)
        values = look.decoder(self.surface.surface, self.surface.surface.table(state), self.relief.corners)
        height, colours = values[:, look.layout["height"][0]], values[:, list(look.layout["albedo"])]
        shade = self._shade(self.relief.normals(height), points, hit, cameras)
        between = Weights(self._faces[points.face.long()], points.barycentric, len(colours))
        coloured = shade * between(colours).clamp(0, 1)
        return Views(pictured(coloured, hit, cameras), pictured(shade * GREY, hit, cameras), values, height)


WAYS = {"normals": Figure, "geometry": MovedFigure, "vertices": VertexFigure}


def task_of(config: NcaConfig, way: str, start: NcaTexture | None = None) -> TextTask:
    """A training on the even sphere whose reliefs are seen one way or the other."""
    task = TextTask(config, words_model(), start.look if start else None)
    task.figures.update({surface: WAYS[way](surface, config.text_relief) for surface in task.meshes})
    return task


class Scene:
    """A grown texture in the views of one step."""

    def __init__(self, task: TextTask, texture: NcaTexture) -> None:
        self.task, (self.sphere,) = task, task.meshes
        state, generator = torch.zeros_like(task.grown(0)), torch.Generator().manual_seed(0)
        with torch.no_grad():
            self.state = task.evolved(0, state, texture.steps, generator)[0]
        task.pool[:] = self.state
        self.sight = task.banks[self.sphere].sight(0)
        self.negative = task.banks[self.sphere].negative(0)

    @property
    def figure(self) -> Figure:
        return self.task.figures[self.sphere]

    def views(self) -> Views:
        return self.figure.textured(self.task.look, self.state.requires_grad_(), self.sight.cameras)

    def distance(self, coloured: torch.Tensor, plain: torch.Tensor) -> torch.Tensor:
        """Of pictures (K, H, W, 3) from the text."""
        parts = self.task.distances(self.sight, self.negative, coloured, plain)
        return torch.stack(list(parts.values())).sum()

    def gradient(self) -> torch.Tensor:
        """Of the distance in the heights, (V,)."""
        views = self.views()
        return torch.autograd.grad(self.distance(views.coloured, views.plain), views.height)[0]

    def step(self) -> None:
        loss = self.task.loss(1, torch.Generator().manual_seed(0)).value
        torch.autograd.grad(loss, self.task.parameters)

    def look(self) -> None:
        """The views of a step alone, with what goes back through them."""
        views = self.views()
        torch.autograd.grad((views.coloured.square() + views.plain.square()).sum(), self.state)

    @torch.no_grad()
    def difference(self, way: torch.Tensor) -> float:
        """The derivative of the distance along a way (V,), by finite differences on the moved surface."""
        figure, views = self.figure, self.views()
        assert isinstance(figure, MovedFigure)
        colours = views.values[:, list(self.task.look.layout["albedo"])].clamp(0, 1)
        ends = [
            self.distance(
                *figure.pictures(figure.moved(views.height + end * way), colours, self.sight.cameras)
            )
            for end in (STEP, -STEP)
        ]
        return float(ends[0] - ends[1]) / (2 * STEP)


def best(function: Callable[[], object]) -> float:
    """Shortest time of several calls after one that warms up [ms]."""
    return 1e3 * min(timeit.repeat(function, number=1, repeat=REPETITIONS + 1)[1:])


def compare(texture: NcaTexture, config: NcaConfig) -> None:
    """Prints times, and gradients."""
    scenes = {way: Scene(task_of(config, way, texture), texture) for way in ("normals", "geometry")}
    print("| through | a step | its views |\n" + "| --- " * 3 + "|")
    for way, scene in scenes.items():
        print(f"| {way} | {best(scene.step):.0f} ms | {best(scene.look):.0f} ms |", flush=True)
    normals, geometry = (scene.gradient() for scene in scenes.values())
    cosine = torch.cosine_similarity(normals, geometry, 0)
    length = geometry.norm()
    print(f"cosine of the gradients {cosine:.3f}, ratio of their lengths {normals.norm() / length:.2f}")
    difference = scenes["geometry"].difference(geometry / length)
    print(f"the geometry's along itself {length:.4g}, by finite differences {difference:.4g}")


def trained(config: NcaConfig, way: str, minutes: float, out: Path) -> None:
    """Trains for so long, and writes the texture."""
    task, begin = task_of(config, way), time.process_time()

    def share() -> float:
        return (time.process_time() - begin) / (60 * minutes)

    def rate(step: int) -> float:
        return config.lr * config.decay ** sum(share() > fall for fall in FALLS)

    state = TrainState(task, config, rate, config.normalise_gradients)
    while share() < 1:
        record = state.advance()
        if state.step % 50 == 0:
            print({name: round(value, 3) for name, value in record.items()}, flush=True)
    memory = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 2**20
    seconds = (time.process_time() - begin) / state.step
    print(f"{way}: {state.step} steps, {seconds:.3f} s of a processor each, {memory:.2f} GiB at most")
    about = {"name": config.text, "text": config.text, "text_model": task.words.model.name}
    about |= {"relief": config.text_relief, "density": config.density, "steps": state.step}
    print(NcaTexture(task.look, about | {"growth_steps": config.text_growth_steps}).save(out))


def main() -> None:
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawTextHelpFormatter)
    commands = parser.add_subparsers(dest="command", required=True)
    steps, train = commands.add_parser("steps"), commands.add_parser("train")
    steps.add_argument("model")
    train.add_argument("way", choices=WAYS)
    train.add_argument("out", type=Path)
    train.add_argument("--text", default="red dots on white")
    train.add_argument("--minutes", type=float, default=6.0)
    for command in (steps, train):
        command.add_argument("--whole", action="store_true")
    options = parser.parse_args()
    let_idle_threads_sleep()
    config = PRESETS["text-words"]
    if options.whole:
        config = replace(config, **{key: getattr(PRESETS["text"], key) for key in WHOLE})
    if options.command == "steps":
        texture = NcaTexture.load(options.model)
        compare(texture, replace(config, text=str(texture.about["text"])))
    else:
        trained(replace(config, text=options.text), options.way, options.minutes, options.out)


if __name__ == "__main__":
    main()
