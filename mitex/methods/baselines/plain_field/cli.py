"""The command-line options of plain radiance fields."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.methods.checks import in_range
from mitex.methods.nerf.ranges import DENSITIES
from mitex.methods.option_types import PlainText
from mitex.methods.options import FieldOptions, TrainingOptions
from mitex.paths import expanded

if TYPE_CHECKING:
    from mitex.methods.nerf.use.applied_field import AppliedField


@dataclass(kw_only=True)
class Fit(TrainingOptions):
    """Train a plain hash-grid radiance field on photos, to compare a captured texture with.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the field;
    `mitex apply RUN --out ASSET` writes the object. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit plain_field --capture durian/ --out runs/plain-durian
      mitex fit plain_field --capture durian/ --set seconds=600
      mitex fit plain_field --capture durian/ --out runs/plain-durian --resume
    """

    capture: Annotated[Path, arg(metavar="DIR")]
    """Folder with transforms.json and photos with masks (alpha), or with plain photos."""

    preset: Annotated[PlainText | None, arg(metavar="fast|paper", help_behavior_hint="(default: fast)")] = (
        None
    )
    """Settings to start from: those of the texture that it is compared with."""

    def run(self) -> None:
        options = self.run_options()
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.methods.baselines import plain_field

        out = self.folder(f"{expanded(self.capture).resolve().name}-plain_field")
        with self.progress() as on_step:
            plain_field.fit(self.capture, out, on_step=on_step, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(FieldOptions):
    """Write the object of a plain field: a picture (.png .jpg), or what is solid as a mesh.

    It takes no mesh: a plain field is of one object, which lies as in its photos' world.

    examples:
      mitex apply runs/plain-durian --out durian.png
      mitex apply runs/plain-durian --out durian.glb
    """

    density: Annotated[float, arg(metavar="X")] = 1.0
    """Factor of the density; more makes thin parts solid."""

    def check(self) -> None:
        super().check()
        in_range("--density", self.density, *DENSITIES)

    def applied(self, out: Path) -> AppliedField:
        from mitex.methods.baselines.plain_field import PlainFieldTexture

        return PlainFieldTexture.load(self.model).apply(density=self.density)
