"""The command-line options of radiance-field textures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Literal

from tyro.conf import arg

from mitex.methods.checks import in_range, mutually_exclusive, reject_unused
from mitex.methods.nerf.ranges import DENSITIES, LIFTS, SIZE
from mitex.methods.option_types import PlainText
from mitex.methods.options import FieldOptions, MeshOptions, TrainingOptions
from mitex.paths import expanded
from mitex.ranges import SCALES, SEEDS
from mitex.suffixes import PICTURES

if TYPE_CHECKING:
    from mitex.methods.nerf.use.applied import AppliedTexture


@dataclass(kw_only=True)
class Fit(TrainingOptions):
    """Capture a texture with its meso-structure from photos (NeRF-Texture).

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --mesh MESH --out ASSET` puts it on any mesh. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit nerf --capture durian/
      mitex fit nerf --capture durian/ --base-mesh ellipsoid.obj --out runs/durian
      mitex fit nerf --capture durian/ --out runs/durian --resume
    """

    capture: Annotated[Path, arg(metavar="DIR")]
    """Folder with transforms.json and photos with masks (alpha), or with plain photos."""

    preset: Annotated[PlainText | None, arg(metavar="fast|paper", help_behavior_hint="(default: fast)")] = (
        None
    )
    """Settings to start from: `fast`, or `paper`, as published for the most part, never trained whole."""

    base_mesh: Annotated[str | None, arg(metavar="MESH", help_behavior_hint="(default: found)")] = None
    """The shape without its texture, in the cameras' world."""

    def run(self) -> None:
        options = self.run_options()
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.methods import nerf

        out = self.folder(expanded(self.capture).resolve().name)
        with self.progress() as on_step:
            nerf.fit(self.capture, out, base_mesh=self.base_mesh, on_step=on_step, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(FieldOptions, MeshOptions):
    """Put a captured texture in the shell of a mesh: a picture (.png .jpg), or what is solid as a mesh.

    examples:
      mitex apply runs/durian --mesh bunny.obj --out bunny.png
      mitex apply runs/durian --mesh bunny.obj --out lit.png --light scene
      mitex apply runs/durian --mesh bunny.obj --out bunny.glb --scale 0.5
      mitex apply runs/grass --mesh hill.obj --out hill.png --guide path.png --scale 0.1
    """

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed: another seed, another variant of the texture."""

    scale: Annotated[float, arg(metavar="X")] = 1.0
    """Size of the texture's elements."""

    size: Annotated[int | None, arg(metavar="N", help_behavior_hint=f"(default: {SIZE})")] = None
    """Side of the synthesized texture [texels]; on the surface, at most."""

    quilting: Annotated[
        Literal["surface", "plane"] | None, arg(help_behavior_hint="(default: surface; with --guide: plane)")
    ] = None
    """Where patches are joined: on the mesh itself, or in the plane and laid over its UVs, as published."""

    density: Annotated[float, arg(metavar="X")] = 1.0
    """Factor of the density; more makes thin parts solid."""

    lift: Annotated[float, arg(metavar="X")] = 1.0
    """1 stands the texture on the mesh, 0 carves it in, as it was captured."""

    guide: Annotated[Path | None, arg(metavar="IMAGE", help_behavior_hint="")] = None
    """A picture over the mesh's UVs that the texture resembles from afar; --scale says how small the
    texture's elements are, and so how fine the picture."""

    light: Annotated[Literal["own", "scene"] | None, arg(help_behavior_hint="(default: own)")] = None
    """Light in a picture: that of the photos, or that of the scene, in which the texture is shaded anew."""

    def check(self) -> None:
        super().check()
        in_range("--seed", self.seed, *SEEDS)
        in_range("--scale", self.scale, *SCALES)
        in_range("--size", self.size, 128, 8192)
        in_range("--density", self.density, *DENSITIES)
        in_range("--lift", self.lift, *LIFTS)
        in_plane = self.guide is not None and self.quilting != "surface"
        mutually_exclusive("--size", "--guide in the plane", self.size is not None and in_plane)

    def check_output(self, out: Path) -> None:
        super().check_output(out)
        picture = out.suffix.lower() in PICTURES
        reject_unused("--light", out, self.light is not None and not picture)

    def picture_options(self) -> dict[str, object]:
        return super().picture_options() | {"light": self.light or "own"}

    def applied(self, out: Path) -> AppliedTexture:
        from mitex.images import read_image
        from mitex.mesh import Mesh
        from mitex.methods.nerf import NerfTexture

        mesh, texture = Mesh.load(self.mesh), NerfTexture.load(self.model)
        return texture.apply(
            mesh,
            size=self.size or SIZE,
            seed=self.seed,
            scale=self.scale,
            density=self.density,
            lift=self.lift,
            guide=None if self.guide is None else read_image(self.guide),
            quilting=self.quilting,
        )
