"""The command-line options of boxes with a captured texture."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.methods.baselines.nerf_tex.ranges import SPACINGS, TILTS
from mitex.methods.checks import in_range
from mitex.methods.nerf.ranges import DENSITIES, LIFTS
from mitex.methods.option_types import ModelName, PlainText
from mitex.methods.options import FieldOptions, MeshOptions, TrainingOptions
from mitex.ranges import SCALES, SEEDS

if TYPE_CHECKING:
    from mitex.methods.nerf.use.applied_field import AppliedField


@dataclass(kw_only=True)
class Fit(TrainingOptions):
    """Learn a piece of a captured texture, laid flat in a box, to compare the texture with (NeRF-Tex).

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the box;
    `mitex apply RUN --mesh MESH --out ASSET` puts it all over a mesh. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit nerf_tex --texture runs/durian --out runs/boxed-durian
      mitex fit nerf_tex --texture runs/durian --set patch=384 views=240
      mitex fit nerf_tex --texture runs/durian --out runs/boxed-durian --resume
    """

    texture: Annotated[ModelName, arg(metavar="RUN|MODEL")]
    """Run folder or model file of `mitex fit nerf`."""

    preset: Annotated[
        PlainText | None, arg(metavar="default|paper", help_behavior_hint="(default: default)")
    ] = None
    """Settings to start from: `default`, or `paper`, which follows the publication."""

    def run(self) -> None:
        options = self.run_options()
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.methods.baselines import nerf_tex
        from mitex.methods.nerf import NerfTexture

        texture = NerfTexture.load(self.texture)
        out = self.folder(f"{texture.about['name']}-nerf_tex")
        with self.progress() as on_step:
            nerf_tex.fit(texture, out, on_step=on_step, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(FieldOptions, MeshOptions):
    """Put boxes all over a mesh: a picture (.png .jpg), or what is solid as a mesh.

    examples:
      mitex apply runs/boxed-durian --mesh bunny.obj --out bunny.png
      mitex apply runs/boxed-durian --mesh bunny.obj --out bunny.glb --scale 0.5 --tilt 10
    """

    scale: Annotated[float, arg(metavar="X")] = 1.0
    """Size of the texture's elements."""

    spacing: Annotated[float, arg(metavar="X")] = 0.5
    """Between boxes [sides of a box]; more leaves places bare."""

    tilt: Annotated[float, arg(metavar="DEG")] = 0.0
    """Standard deviation by which boxes lean from the normals [degrees]."""

    aligned: Annotated[bool, arg(help_behavior_hint="")] = False
    """Boxes point in one direction as far as they can, instead of being turned at random."""

    lift: Annotated[float, arg(metavar="X")] = 1.0
    """1 stands the texture on the mesh, 0 carves it in, as it was captured."""

    density: Annotated[float, arg(metavar="X")] = 1.0
    """Factor of the density; more makes thin parts solid."""

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed: another seed, other places."""

    def check(self) -> None:
        super().check()
        in_range("--scale", self.scale, *SCALES)
        in_range("--spacing", self.spacing, *SPACINGS)
        in_range("--tilt", self.tilt, *TILTS)
        in_range("--lift", self.lift, *LIFTS)
        in_range("--density", self.density, *DENSITIES)
        in_range("--seed", self.seed, *SEEDS)

    def applied(self, out: Path) -> AppliedField:
        from mitex.mesh import Mesh
        from mitex.methods.baselines.nerf_tex import NerfTexTexture

        texture = NerfTexTexture.load(self.model)
        return texture.apply(
            Mesh.load(self.mesh),
            scale=self.scale,
            spacing=self.spacing,
            tilt=self.tilt,
            aligned=self.aligned,
            lift=self.lift,
            density=self.density,
            seed=self.seed,
        )
