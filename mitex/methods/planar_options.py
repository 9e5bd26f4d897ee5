"""The options of methods that learn from a picture alone, and put what they learned on any mesh."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, ClassVar

from tyro.conf import arg

from mitex.lazy import load
from mitex.methods.checks import in_range
from mitex.methods.options import ExemplarOptions, MeshOptions
from mitex.ranges import SCALES, TEXELS

if TYPE_CHECKING:
    from mitex.methods.interface import Applied


@dataclass(kw_only=True)
class PlanarFitOptions(ExemplarOptions):
    """A fit of an exemplar; a method's own class has the help and the examples.

    Attributes:
        method: the baseline that fits.
    """

    method: ClassVar[str]

    def run(self) -> None:
        options = self.run_options()
        from mitex.exemplar import Exemplar

        exemplar = Exemplar.load(self.exemplar)
        out = self.folder(f"{exemplar.name}-{self.method}")
        fit = load(f"mitex.methods.baselines.{self.method}:fit")
        with self.progress() as on_step:
            fit(exemplar, out, on_step=on_step, **options)
        print(out)


@dataclass(kw_only=True)
class PlanarOptions(MeshOptions):
    """How it is put on a mesh; a method's own class has the help and the examples."""

    scale: Annotated[float, arg(metavar="X")] = 1.0
    """Size of the pattern; 1 is that of a surface texture."""

    resolution: Annotated[int, arg(metavar="N")] = 512
    """Side of the albedo texture [texels]."""

    keep_uvs: Annotated[bool, arg(help_behavior_hint="")] = False
    """Use the mesh's own UVs, which must not overlap."""

    def check(self) -> None:
        in_range("--scale", self.scale, *SCALES)
        in_range("--resolution", self.resolution, *TEXELS)

    def further(self) -> dict[str, object]:
        """What a method's `apply` takes beside that."""
        return {}

    def applied(self, out: Path) -> Applied:
        from mitex.mesh import Mesh
        from mitex.methods.registry import load

        texture, mesh = load(self.model), Mesh.load(self.mesh)
        options = {"scale": self.scale, "resolution": self.resolution, "keep_uvs": self.keep_uvs}
        return texture.apply(mesh, **options, **self.further())
