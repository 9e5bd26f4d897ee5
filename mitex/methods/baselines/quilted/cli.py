"""The command-line options of quilted pictures."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.methods.checks import in_range
from mitex.methods.option_types import ModelName
from mitex.methods.options import FitOptions, MeshOptions
from mitex.ranges import SCALES, TEXELS

if TYPE_CHECKING:
    from mitex.asset import Asset


@dataclass(kw_only=True)
class Fit(FitOptions):
    """Quilt pictures of a captured texture's patches, to compare the texture with a flat one.

    `mitex apply RUN --mesh MESH --out ASSET` puts the picture on any mesh.

    examples:
      mitex fit quilted --texture runs/durian --out runs/flat-durian
      mitex fit quilted --texture runs/durian --set size=2048 even=false relit=false
    """

    texture: Annotated[ModelName, arg(metavar="RUN|MODEL")]
    """Run folder or model file of `mitex fit nerf`."""

    def run(self) -> None:
        options = self.run_options()
        from mitex.methods.baselines import quilted
        from mitex.methods.nerf import NerfTexture

        texture = NerfTexture.load(self.texture)
        out = self.folder(f"{texture.about['name']}-quilted")
        quilted.fit(texture, out, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(MeshOptions):
    """Put a quilted picture on a mesh, repeated over its UVs.

    examples:
      mitex apply runs/flat-durian --mesh bunny.obj --out bunny.glb
      mitex apply runs/flat-durian --mesh bunny.obj --out bunny.png --scale 0.5
    """

    scale: Annotated[float, arg(metavar="X")] = 1.0
    """Size of the texture's elements."""

    resolution: Annotated[int, arg(metavar="N")] = 1024
    """Side of the albedo texture [texels]."""

    def check(self) -> None:
        in_range("--scale", self.scale, *SCALES)
        in_range("--resolution", self.resolution, *TEXELS)

    def applied(self, out: Path) -> Asset:
        from mitex.mesh import Mesh
        from mitex.methods.baselines.quilted import QuiltedTexture

        texture = QuiltedTexture.load(self.model)
        return texture.apply(Mesh.load(self.mesh), scale=self.scale, resolution=self.resolution)
