"""The options that every `mitex fit` has."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import UseAppendAction, arg

from mitex.cli.checks import SEEDS, in_range, settings


@dataclass(kw_only=True)
class Fitting:
    """Options shared by the methods' commands."""

    preset: Annotated[str | None, arg(metavar="NAME", help_behavior_hint="")] = None
    """Settings to start from."""

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

    seed: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the preset's)")] = None
    """Random seed."""

    steps: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the preset's)")] = None
    """Training steps."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def shared(self, **flags: object) -> dict[str, Any]:
        """Checks seed and steps; what every `fit` takes, with these and further `flags` as settings."""
        in_range("--seed", self.seed, *SEEDS)
        in_range("--steps", self.steps, 1)
        return {
            "preset": self.preset,
            "config": self.config,
            "overrides": settings(self.set, seed=self.seed, steps=self.steps, **flags),
            "resume": self.resume,
            "quiet": self.quiet,
        }


@dataclass(kw_only=True)
class ExemplarFitting(Fitting):
    """Options of the methods that learn from images."""

    exemplar: Annotated[str, arg(metavar="IMAGE|DIR|NAME")]
    """PNG or JPEG, a folder with any of albedo, height, normal, roughness, ambient_occlusion, or a name."""

    out: Annotated[Path | None, arg(metavar="RUN", help_behavior_hint="(default: runs/EXEMPLAR)")] = None
    """Run folder."""
