"""A method in one file: a checkerboard in object space, whose cells are fitted to an image's mean colours.

It is what the page "Write a method" walks through, and is registered from outside the package, through the
entry point `mitex.methods` in the folder `mitex_checkerboard-1.0.dist-info`.
"""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Annotated, Any, Unpack

import numpy as np
import torch
from tyro.conf import arg

from mitex.asset import Asset
from mitex.exemplar import Exemplar
from mitex.mesh import Mesh
from mitex.methods.method import Method
from mitex.methods.options import ExemplarOptions, MeshOptions
from mitex.training import model_file
from mitex.training.fit import Run
from mitex.training.settings import RunOptions, TrainingConfig, key
from mitex.training.task import Step

METHOD = Method(
    name="checkerboard",
    title="two colours of an image in cells of space (an example)",
    presets="checkerboard:PRESETS",
    fit="checkerboard:Fit",
    apply="checkerboard:Apply",
    texture="checkerboard:Checkerboard",
)


@dataclass(frozen=True)
class Config(TrainingConfig):
    """Settings of a checkerboard."""

    preset: str = "plain"
    steps: int = 20
    cell: float = key(0.25, "side of a cell [radii of the mesh]", 0.01, 2)
    lr: float = key(0.1, "learning rate", 0, 1)


DEFAULT = Config()
PRESETS = {DEFAULT.preset: DEFAULT}


@dataclass(frozen=True, eq=False)
class Checkerboard:
    """Two colours (2, 3), sRGB in [0, 1], in turns."""

    colours: np.ndarray
    about: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, source: str | Path) -> Checkerboard:
        with model_file.opened(source, METHOD.name) as (tensors, about):
            return cls(tensors["colours"].numpy(), about)

    def save(self, path: str | Path) -> Path:
        return model_file.save(path, {"colours": torch.from_numpy(self.colours)}, METHOD.name, self.about)

    def apply(self, mesh: Mesh, *, offset: float = 0.0) -> Asset:
        cells = np.floor(mesh.normalised()[0].vertices / self.about["cell"] + offset).astype(int)
        return Asset(mesh, {"albedo": self.colours[cells.sum(1) % 2]}, name=mesh.name)


class Task:
    """Finds the two colours: the darker and the lighter half of the pixels, by k-means with momentum."""

    def __init__(self, config: Config, exemplar: Exemplar) -> None:
        self.exemplar, self.pixels = exemplar, torch.from_numpy(exemplar.maps["albedo"].reshape(-1, 3))
        drawn = torch.Generator().manual_seed(config.seed)
        self.colours = torch.rand(2, 3, generator=drawn).requires_grad_()
        self.parameters = [self.colours]

    def begin(self, step: int, generator: torch.Generator) -> None:
        """Nothing changes before the loss."""

    def loss(self, step: int, generator: torch.Generator) -> Step:
        pixels = self.pixels[torch.randint(len(self.pixels), (256,), generator=generator)]
        return Step(torch.cdist(pixels, self.colours).amin(1).mean())

    def state(self) -> dict[str, torch.Tensor]:
        return {"colours": self.colours.detach()}

    def load_state(self, state: dict[str, torch.Tensor]) -> None:
        with torch.no_grad():
            self.colours.copy_(state["colours"])

    def preview(self, step: int) -> np.ndarray:
        return np.tile(self.colours.detach().clamp(0, 1).numpy()[None], (32, 16, 1))

    def metadata(self) -> dict[str, str]:
        return {"method": METHOD.name, "exemplar": self.exemplar.name}


def fit(exemplar: Exemplar | str | Path, out: str | Path, **options: Unpack[RunOptions]) -> Checkerboard:
    """Fits the colours of an image; arguments as of every method's `fit`."""
    run = Run.of(PRESETS, out, **options)
    image = exemplar if isinstance(exemplar, Exemplar) else Exemplar.load(exemplar)
    task = Task(run.config, image)

    def texture(about: dict[str, Any]) -> Checkerboard:
        colours = task.colours.detach().clamp(0, 1).numpy()
        return Checkerboard(colours, {**about, "cell": run.config.cell})

    return run.train(task, image.name, texture, lr=run.config.lr)


@dataclass(kw_only=True)
class Fit(ExemplarOptions):
    """Learn two colours of an image.

    examples:
      mitex fit checkerboard --exemplar lava --out runs/checkers
    """

    def run(self) -> None:
        options, image = self.run_options(), Exemplar.load(self.exemplar)
        out = self.folder(image.name)
        fit(image, out, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(MeshOptions):
    """Colour a mesh by cells of space.

    examples:
      mitex apply runs/checkers --mesh bunny.obj --out bunny.glb --offset 0.5
    """

    offset: Annotated[float, arg(metavar="X")] = 0.0
    """Shifts the cells, in their sides."""

    def applied(self, out: Path) -> Asset:
        return Checkerboard.load(self.model).apply(Mesh.load(self.mesh), offset=self.offset)
