"""The command-line options of solid textures."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, ClassVar

from tyro.conf import arg

from mitex.methods.checks import in_range
from mitex.methods.planar_options import PlanarFitOptions, PlanarOptions
from mitex.ranges import SEEDS


@dataclass(kw_only=True)
class Fit(PlanarFitOptions):
    """Learn a solid, like marble or wood, whose slices look like an exemplar's albedo, as Gutierrez et al.
    (2020) do.

    `mitex apply RUN --mesh MESH --out ASSET` cuts a mesh out of it. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit solid_texture --exemplar lava --out runs/solid-lava
      mitex fit solid_texture --exemplar pebbles.png --preset paper
      mitex fit solid_texture --exemplar lava --out runs/solid-lava --resume
    """

    method: ClassVar[str] = "solid_texture"


@dataclass(kw_only=True)
class Apply(PlanarOptions):
    """Cut a mesh out of the solid.

    examples:
      mitex apply runs/solid-lava --mesh vase --out vase.glb
      mitex apply runs/solid-lava --mesh bunny.obj --out bunny.png --seed 7 --scale 2
    """

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed: another seed, another solid."""

    def check(self) -> None:
        super().check()
        in_range("--seed", self.seed, *SEEDS)

    def further(self) -> dict[str, object]:
        return {"seed": self.seed}
