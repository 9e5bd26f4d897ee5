"""The command-line options of displacement maps."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.methods.baselines.displacement.config import SUBDIVISIONS
from mitex.methods.checks import in_range
from mitex.methods.geometric.config import ReferenceName
from mitex.methods.options import FitOptions, MeshOptions
from mitex.ranges import SCALES

if TYPE_CHECKING:
    from mitex.asset import Asset


@dataclass(kw_only=True)
class Fit(FitOptions):
    """Bake the relief of one mesh as a height map, as modelling programs do.

    A square window is taken off the side that faces +z. `mitex apply RUN --mesh MESH --out ASSET` displaces
    any mesh by it.

    examples:
      mitex fit displacement --reference cactus.obj --out runs/cactus-map
      mitex fit displacement --reference cactus.obj --set window=0.2 resolution=512
    """

    reference: Annotated[ReferenceName, arg(metavar="MESH|NAME")]
    """Mesh file (.obj .ply .stl .glb .gltf .off), or a reference by formula, as of mitex fit geometric."""

    def run(self) -> None:
        options = self.run_options()
        from mitex.methods.baselines import displacement
        from mitex.methods.geometric.references import find_reference

        reference = find_reference(self.reference)
        out = self.folder(f"{reference.name}-displacement")
        displacement.fit(reference, out, **options)
        print(out)


@dataclass(kw_only=True)
class Apply(MeshOptions):
    """Displace a mesh along its normals by a baked height map, repeated over its UVs.

    examples:
      mitex apply runs/cactus-map --mesh bunny.obj --out bunny.glb --subdivide 2 --scale 0.5
    """

    scale: Annotated[float, arg(metavar="X")] = 1.0
    """Size of the features beside the whole mesh, against that on the reference."""

    subdivide: Annotated[int, arg(metavar="N")] = 0
    """How often every face is split in four first."""

    def check(self) -> None:
        in_range("--scale", self.scale, *SCALES)
        in_range("--subdivide", self.subdivide, *SUBDIVISIONS)

    def applied(self, out: Path) -> Asset:
        from mitex.mesh import Mesh
        from mitex.methods.baselines.displacement import DisplacementMap

        texture = DisplacementMap.load(self.model)
        return texture.apply(Mesh.load(self.mesh), scale=self.scale, subdivide=self.subdivide)
