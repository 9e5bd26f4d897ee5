"""The command-line options of reaction-diffusion textures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from tyro.conf import arg

from mitex.methods.baselines.reaction_diffusion.ranges import MOST_STEPS, STEPS
from mitex.methods.checks import in_range
from mitex.methods.planar_options import PlanarFitOptions, PlanarOptions
from mitex.ranges import SEEDS

if TYPE_CHECKING:
    from mitex.methods.interface import Applied


@dataclass(kw_only=True)
class Fit(PlanarFitOptions):
    """Learn chemicals that react and diffuse to a pattern like an exemplar's albedo, as Mordvintsev et al.
    (2021) do.

    `mitex apply RUN --mesh MESH --out ASSET` grows it on any mesh. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit reaction_diffusion --exemplar lava --out runs/chemical-lava
      mitex fit reaction_diffusion --exemplar pebbles.png --preset paper
      mitex fit reaction_diffusion --exemplar lava --out runs/chemical-lava --resume
    """

    method: ClassVar[str] = "reaction_diffusion"


@dataclass(kw_only=True)
class Apply(PlanarOptions):
    """Let the chemicals react and diffuse on a mesh.

    examples:
      mitex apply runs/chemical-lava --mesh vase --out vase.glb
      mitex apply runs/chemical-lava --mesh bunny.obj --out bunny.png --seed 7 --scale 2
    """

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed: another seed, another variant of the texture."""

    steps: Annotated[int, arg(metavar="N")] = STEPS
    """Steps of time."""

    def check(self) -> None:
        super().check()
        in_range("--seed", self.seed, *SEEDS)
        in_range("--steps", self.steps, 0, MOST_STEPS)

    def further(self) -> dict[str, object]:
        return {"seed": self.seed, "steps": self.steps}

    def applied(self, out: Path) -> Applied:
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        return super().applied(out)
