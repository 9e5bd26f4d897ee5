"""The command-line options of MeshNCA."""

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.errors import ConfigError
from mitex.methods.checks import SEEDS, in_range, mutually_exclusive, reject_unused
from mitex.methods.options import ExemplarOptions, MeshOptions

if TYPE_CHECKING:
    from mitex.asset import Asset

RESOLUTION = 1024  # of baked textures [texels]


@dataclass(kw_only=True)
class Fit(ExemplarOptions):
    """Learn a texture from an image or a set of PBR maps with a neural cellular automaton (MeshNCA).

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture; Ctrl-C
    saves, and --resume goes on.

    examples:
      mitex fit nca --exemplar pebbles.png --out runs/pebbles
      mitex fit nca --exemplar cobblestone --steps 300 --set hidden=96
      mitex fit nca --exemplar maps/ --preset paper --out runs/paper
      mitex fit nca --exemplar pebbles.png --out runs/pebbles --resume
      mitex fit nca --settings --preset paper
    """

    preset: Annotated[str | None, arg(metavar="patch|paper", help_behavior_hint="(default: patch)")] = None
    """Settings to start from: `patch` is fast, `paper` follows the publication."""

    init: Annotated[str | None, arg(metavar="MODEL|RUN", help_behavior_hint="")] = None
    """Start from the weights of a model or a run."""

    def run(self) -> None:
        options = self.run_options()
        mutually_exclusive("--resume", "--init", self.resume and self.init is not None)
        from mitex.exemplar import Exemplar

        exemplar = Exemplar.load(self.exemplar)
        out = self.folder(exemplar.name)
        from mitex.methods import nca

        nca.fit(exemplar, out, init=self.init, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(MeshOptions):
    """Grow a cellular automaton's texture on a mesh.

    examples:
      mitex apply runs/pebbles --mesh bunny.obj --out bunny.glb
      mitex apply pebbles --mesh bunny.obj --out bunny.glb --subdivide 2 --resolution 2048
      mitex apply pebbles --mesh scan.ply --out scan.glb --vertex-colors --seed 7 --orientation 45
    """

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed: another seed, another variant of the texture."""

    steps: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: 200)")] = None
    """Steps of the automaton."""

    subdivide: Annotated[str, arg(metavar="auto|N")] = "auto"
    """How often to subdivide the automaton's copy of the mesh; auto: to the training's density."""

    orientation: Annotated[float, arg(metavar="DEG")] = 0.0
    """Turns the texture on the surface [degrees]."""

    scale: Annotated[float, arg(metavar="X")] = 1.0
    """Size of the pattern."""

    resolution: Annotated[int | None, arg(metavar="N", help_behavior_hint=f"(default: {RESOLUTION})")] = None
    """Side of the baked textures [texels]."""

    vertex_colors: Annotated[bool, arg(help_behavior_hint="")] = False
    """Write colours at the vertices instead of textures."""

    keep_dense: Annotated[bool, arg(help_behavior_hint="")] = False
    """Write the subdivided, rounded mesh instead of the given one."""

    def check(self) -> None:
        self._levels()
        in_range("--seed", self.seed, *SEEDS)
        in_range("--steps", self.steps, 1, 10_000)
        in_range("--orientation", self.orientation, -360.0, 360.0)
        in_range("--scale", self.scale, 0.05, 20.0)
        in_range("--resolution", self.resolution, 64, 8192)
        mutually_exclusive(
            "--resolution", "--vertex-colors", self.resolution is not None and self.vertex_colors
        )

    def check_output(self, out: Path) -> None:
        suffix = out.suffix.lower()
        reject_unused("--vertex-colors", out, self.vertex_colors and suffix in (".obj", ".exr"))
        reject_unused("--resolution", out, self.resolution is not None and suffix == ".ply")

    def applied(self, out: Path) -> Asset:
        from mitex.mesh import Mesh
        from mitex.methods.nca import NcaTexture

        textures = out.suffix.lower() != ".ply" and not self.vertex_colors
        return NcaTexture.load(self.model).apply(
            Mesh.load(self.mesh),
            seed=self.seed,
            steps=self.steps,
            subdivide=self._levels(),
            orientation=math.radians(self.orientation),
            scale=self.scale,
            resolution=(self.resolution or RESOLUTION) if textures else None,
            keep_dense=self.keep_dense,
        )

    def _levels(self) -> int | str:
        if self.subdivide == "auto":
            return "auto"
        if self.subdivide not in list("0123456"):
            raise ConfigError(f"--subdivide cannot be {self.subdivide!r}", "use auto or a number from 0 to 6")
        return int(self.subdivide)
