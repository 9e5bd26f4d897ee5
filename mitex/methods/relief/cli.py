"""The command-line options of reliefs from pictures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.methods.checks import in_range
from mitex.methods.options import ExemplarOptions, MeshFitOptions, OptionalMeshOptions
from mitex.ranges import SCALES

if TYPE_CHECKING:
    from mitex.asset import Asset


@dataclass(kw_only=True)
class Fit(MeshFitOptions, ExemplarOptions):
    """Shape the surface of a mesh after an exemplar's height or normal map: surface synthesizes all maps of
    the exemplar, then the mesh itself is moved until it looks like the exemplar's relief. Colours stay on it.

    The run folder gets config.toml, checkpoint.safetensors, metrics.jsonl, previews and the texture;
    `mitex apply RUN --out ASSET` writes it. Ctrl-C saves, and --resume goes on.

    examples:
      mitex fit relief --exemplar cobblestone --mesh vase --scale 0.5 --out runs/cobbles
      mitex fit relief --exemplar maps/ --mesh bunny.obj --depth 0.03
      mitex fit relief --exemplar normals/ --mesh bunny.obj --set start=flat
      mitex fit relief --exemplar cobblestone --mesh vase --out runs/cobbles --resume
    """

    scale: Annotated[float | None, arg(metavar="X", help_behavior_hint="(default: 1)")] = None
    """Size of the pattern."""

    depth: Annotated[
        float | None, arg(metavar="X", help_behavior_hint="(default: what the exemplar's normals say)")
    ] = None
    """Depth of the relief [widths of the exemplar]; needed for a height map without normals."""

    def run(self) -> None:
        in_range("--scale", self.scale, *SCALES)
        in_range("--depth", self.depth, 0.0, 1.0)
        options = self.run_options(scale=self.scale, depth=self.depth)
        from mitex.exemplar import Exemplar
        from mitex.mesh import Mesh
        from mitex.methods import relief

        exemplar, mesh = Exemplar.load(self.exemplar), Mesh.load(self.mesh)
        out = self.folder(f"{exemplar.name}-{mesh.name}-relief")
        with self.progress() as on_step:
            relief.fit(exemplar, mesh, out, keep_uvs=self.keep_uvs, on_step=on_step, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(OptionalMeshOptions):
    """Write a relief: the moved mesh with the colours that belong to it.

    --mesh only checks that a mesh is the one that the relief was made on.

    examples:
      mitex apply runs/cobbles --out cobbles.glb
      mitex apply runs/cobbles --out print.obj --untangle
    """

    untangle: Annotated[bool, arg(help_behavior_hint="")] = False
    """Draw the relief back where the surface would pierce itself, until it does so at most twice as often as
    the mesh itself."""

    def applied(self, out: Path) -> Asset:
        from mitex.mesh import Mesh
        from mitex.methods.relief import ReliefTexture

        mesh = None if self.mesh is None else Mesh.load(self.mesh)
        return ReliefTexture.load(self.model).apply(mesh, untangle=self.untangle)
