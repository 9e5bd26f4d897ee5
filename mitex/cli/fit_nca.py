"""`mitex fit nca`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import UseAppendAction, arg

from mitex.cli.checks import SEEDS, in_range, not_both, settings


@dataclass
class FitNca:
    """Learn a texture from an image or a set of PBR maps with a neural cellular automaton (MeshNCA).

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl and previews; Ctrl-C saves, and
    --resume goes on.

    examples:
      mitex fit nca --exemplar pebbles.png --out runs/pebbles
      mitex fit nca --exemplar cobblestone --steps 300 --set hidden=96
      mitex fit nca --exemplar maps/ --preset paper --out runs/paper
      mitex fit nca --exemplar pebbles.png --out runs/pebbles --resume
    """

    exemplar: Annotated[str, arg(metavar="IMAGE|DIR|NAME")]
    """PNG or JPEG, a folder with any of albedo, height, normal, roughness, ambient_occlusion, or a name."""

    out: Annotated[Path | None, arg(metavar="RUN", help_behavior_hint="(default: runs/EXEMPLAR)")] = None
    """Run folder."""

    preset: Annotated[str | None, arg(metavar="patch|paper", help_behavior_hint="(default: patch)")] = None
    """Settings to start from: `patch` is fast, `paper` follows the publication."""

    config: Annotated[Path | None, arg(metavar="FILE", help_behavior_hint="")] = None
    """TOML file with any of the settings, or a run's config.toml."""

    set: Annotated[
        tuple[tuple[str, ...], ...],
        UseAppendAction,
        arg(metavar="KEY=VALUE ...", help_behavior_hint="(repeatable)"),
    ] = ()
    """Any setting."""

    resume: Annotated[bool, arg(help_behavior_hint="")] = False
    """Go on from the run's checkpoint."""

    init: Annotated[str | None, arg(metavar="MODEL|RUN", help_behavior_hint="")] = None
    """Start from the weights of a model or a run."""

    seed: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the preset's)")] = None
    """Random seed."""

    steps: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the preset's)")] = None
    """Training steps."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        in_range("--seed", self.seed, *SEEDS)
        in_range("--steps", self.steps, 1)
        not_both("--resume", "--init", self.resume and self.init is not None)
        overrides = settings(self.set, seed=self.seed, steps=self.steps)
        from mitex.exemplar import Exemplar

        exemplar = Exemplar.load(self.exemplar)
        out = self.out or Path("runs") / exemplar.name
        from mitex.methods import nca

        nca.fit(
            exemplar,
            out,
            preset=self.preset,
            config=self.config,
            overrides=overrides,
            resume=self.resume,
            init=self.init,
            quiet=self.quiet,
        )
        print(out)
