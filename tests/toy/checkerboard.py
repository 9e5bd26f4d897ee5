"""A whole method in one file: a checkerboard in object space, in two colours learned from an image."""

from __future__ import annotations

from dataclasses import dataclass, field
from typing import Annotated, Any, Unpack

import numpy as np
import torch
from tyro.conf import arg

from mitex.asset import Asset
from mitex.exemplar import Exemplar
from mitex.mesh import Mesh
from mitex.methods.method import Method
from mitex.methods.options import ExemplarOptions, MeshOptions
from mitex.training import ParameterTask, Step, model_file
from mitex.training.fit import Run
from mitex.training.settings import RunOptions, TrainingConfig, key

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
    preset: str = "plain"
    cell: float = key(0.25, "side of a cell [radii of the mesh]", 0.01, 2)
    lr: float = key(0.05, "learning rate", 0, 1)


PRESETS = {"plain": Config()}


@dataclass(frozen=True)
class Checkerboard:
    colours: torch.Tensor  # (2, 3) sRGB in [0, 1]
    about: dict[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, source) -> Checkerboard:
        with model_file.opened(source, METHOD.name) as (tensors, about):
            return cls(tensors["colours"], about)

    def save(self, path):
        return model_file.save(path, {"colours": self.colours}, METHOD.name, self.about)

    def apply(self, mesh: Mesh, *, offset: float = 0.0) -> Asset:
        cells = np.floor(mesh.normalised()[0].vertices / self.about["cell"] + offset).astype(int)
        return Asset(mesh, {"albedo": self.colours.numpy()[cells.sum(1) % 2]}, name=mesh.name)


class Task(ParameterTask):
    """Two colours, each near those pixels that are nearer to it than to the other."""

    def __init__(self, config: Config, exemplar: Exemplar) -> None:
        super().__init__({"colours": torch.rand(2, 3, generator=torch.Generator().manual_seed(config.seed))})
        self.exemplar, self.pixels = exemplar, torch.from_numpy(exemplar.maps["albedo"]).flatten(0, 1)

    def loss(self, step, generator) -> Step:
        pixels = self.pixels[torch.randint(len(self.pixels), (256,), generator=generator)]
        return Step(torch.cdist(pixels, self.named["colours"]).amin(1).mean())

    def metadata(self) -> dict[str, str]:
        return {"method": METHOD.name, "exemplar": self.exemplar.name}


def fit(exemplar: Exemplar | str, out=None, **options: Unpack[RunOptions]) -> Checkerboard:
    run = Run.of(PRESETS, out, **options)
    exemplar = exemplar if isinstance(exemplar, Exemplar) else Exemplar.load(exemplar)
    task, cell = Task(run.config, exemplar), run.config.cell

    def texture(about: dict[str, Any]) -> Checkerboard:
        return Checkerboard(task.named["colours"].detach().clamp(0, 1), about | {"cell": cell})

    return run.train(task, exemplar.name, texture, lr=run.config.lr)


@dataclass(kw_only=True)
class Fit(ExemplarOptions):
    """Learn two colours of an image.

    examples:
      mitex fit checkerboard --exemplar lava --out runs/checkers
    """

    def run(self) -> None:
        exemplar = Exemplar.load(self.exemplar)
        out = self.folder(exemplar.name)
        with self.progress() as on_step:
            fit(exemplar, out, on_step=on_step, **self.run_options())
        print(out)


@dataclass(kw_only=True)
class Apply(MeshOptions):
    """Colour a mesh by cells of space.

    examples:
      mitex apply runs/checkers --mesh bunny.obj --out bunny.glb --offset 0.5
    """

    offset: Annotated[float, arg(metavar="X")] = 0.0
    """Shifts the cells, in their sides."""

    def applied(self, out) -> Asset:
        return Checkerboard.load(self.model).apply(Mesh.load(self.mesh), offset=self.offset)
