"""The command-line options of quilted pictures of an exemplar."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated

from tyro.conf import arg

from mitex.methods.option_types import ExemplarName
from mitex.methods.options import FitOptions
from mitex.methods.planar_options import PlanarOptions


@dataclass(kw_only=True)
class Fit(FitOptions):
    """Quilt a flat picture from blocks of an exemplar's albedo, as Efros and Freeman (2001) do.

    `mitex apply RUN --mesh MESH --out ASSET` puts the picture on any mesh by its UVs.

    examples:
      mitex fit image_quilting --exemplar lava --out runs/quilted-lava
      mitex fit image_quilting --exemplar pebbles.png --set block=96 size=1024
    """

    exemplar: Annotated[ExemplarName, arg(metavar="IMAGE|DIR|NAME")]
    """PNG or JPEG, a folder with an albedo, or a name."""

    def run(self) -> None:
        options = self.run_options()
        from mitex.exemplar import Exemplar
        from mitex.methods.baselines import image_quilting

        exemplar = Exemplar.load(self.exemplar)
        out = self.folder(f"{exemplar.name}-image_quilting")
        image_quilting.fit(exemplar, out, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(PlanarOptions):
    """Put a quilted picture on a mesh by its UVs; where charts meet, the pattern breaks.

    examples:
      mitex apply runs/quilted-lava --mesh vase --out vase.glb
      mitex apply runs/quilted-lava --mesh bunny.obj --out bunny.png --scale 0.5 --keep-uvs
    """
