"""The options of `mitex apply` for flat pictures that are put on by UVs."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.methods.checks import in_range
from mitex.methods.options import MeshOptions

if TYPE_CHECKING:
    from mitex.methods.interface import Applied


@dataclass(kw_only=True)
class PlanarOptions(MeshOptions):
    """Options that all such methods have; their own class has the help and the examples."""

    scale: Annotated[float, arg(metavar="X")] = 1.0
    """Size of the pattern; 1 is that of a surface texture."""

    resolution: Annotated[int, arg(metavar="N")] = 512
    """Side of the albedo texture [texels]."""

    keep_uvs: Annotated[bool, arg(help_behavior_hint="")] = False
    """Use the mesh's own UVs, which must not overlap."""

    def check(self) -> None:
        in_range("--scale", self.scale, 0.05, 20.0)
        in_range("--resolution", self.resolution, 16, 8192)

    def applied(self, out: Path) -> Applied:
        from mitex.mesh import Mesh
        from mitex.methods.registry import load

        texture, mesh = load(self.model), Mesh.load(self.mesh)
        options = {"scale": self.scale, "resolution": self.resolution, "keep_uvs": self.keep_uvs}
        return texture.apply(mesh, **options)
