"""`mitex fit nca`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from mitex.cli.checks import not_both
from mitex.cli.fitting import ExemplarFitting


@dataclass(kw_only=True)
class FitNca(ExemplarFitting):
    """Learn a texture from an image or a set of PBR maps with a neural cellular automaton (MeshNCA).

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl and previews; Ctrl-C saves, and
    --resume goes on.

    examples:
      mitex fit nca --exemplar pebbles.png --out runs/pebbles
      mitex fit nca --exemplar cobblestone --steps 300 --set hidden=96
      mitex fit nca --exemplar maps/ --preset paper --out runs/paper
      mitex fit nca --exemplar pebbles.png --out runs/pebbles --resume
    """

    preset: Annotated[str | None, arg(metavar="patch|paper", help_behavior_hint="(default: patch)")] = None
    """Settings to start from: `patch` is fast, `paper` follows the publication."""

    init: Annotated[str | None, arg(metavar="MODEL|RUN", help_behavior_hint="")] = None
    """Start from the weights of a model or a run."""

    def run(self) -> None:
        shared = self.shared()
        not_both("--resume", "--init", self.resume and self.init is not None)
        from mitex.exemplar import Exemplar

        exemplar = Exemplar.load(self.exemplar)
        out = self.out or Path("runs") / exemplar.name
        from mitex.methods import nca

        nca.fit(exemplar, out, init=self.init, **shared)
        print(out)
