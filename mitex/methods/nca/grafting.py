"""`mitex graft`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from mitex.errors import ConfigError
from mitex.methods.checks import reject_unused
from mitex.methods.nca import METHOD
from mitex.methods.nca.growth_options import BakedOptions
from mitex.methods.options import MeshOptions
from mitex.methods.registry import method_of
from mitex.suffixes import PICTURES

if TYPE_CHECKING:
    from pathlib import Path

    from mitex.asset import Asset
    from mitex.mesh import Mesh
    from mitex.methods.nca.graft import Graft


@dataclass(kw_only=True)
class Grafted(BakedOptions, MeshOptions):
    """Grow two textures of one family on a mesh, and let one become the other where the weights say so.

    `mitex models` tells which are of one family; models that were trained from them (--init) are, too.

    examples:
      mitex graft ceramic bricks --mesh bunny.obj --weights y --out bunny.glb
      mitex graft ceramic bricks --mesh bunny.obj --weights x:-0.2:0.2 --out bunny.png
      mitex graft lava shells --mesh bunny.obj --weights 0,0.5,0.3,0.4 --out bunny.glb
      mitex graft lava shells --mesh bunny.obj --weights painted.png --out maps/
      mitex graft lava shells --mesh bunny.obj --weights weights.npy --out bunny.ply
      mitex graft lava shells --mesh bunny.obj --weights y --out bunny.glb --field about-y
    """

    second: Annotated[Positional[str], arg(metavar="RUN|MODEL")]
    """The texture where the weight is 1; the first one is where it is 0."""

    weights: Annotated[str, arg(metavar="W")]
    """x, y or z for a gradient along that axis from end to end, or y:LOW:HIGH; X,Y,Z,RADIUS for a place
    around a point [mesh units]; a .npy or .ply with a value from 0 to 1 at each vertex; a .png painted over
    the UVs; or one number."""

    def check(self) -> None:
        self.check_growth()

    def inputs(self) -> list:
        return [*super().inputs(), self.second, self.weights, *self.growth_files()]

    def check_output(self, out: Path) -> None:
        suffix = out.suffix.lower()
        reject_unused(
            "--vertex-colours", out, self.vertex_colours and suffix not in (".glb", ".ply", *PICTURES)
        )
        reject_unused("--resolution", out, self.resolution is not None and suffix == ".ply")

    def applied(self, out: Path) -> Asset:
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.mesh import Mesh

        mesh = Mesh.load(self.mesh)
        graft = grafted(self.model, self.second, mesh, self.weights)
        return graft.apply(mesh, seed=self.seed, **self.baked(out.suffix.lower()))


def grafted(first: str, second: str, mesh: Mesh, weights: str) -> Graft:
    """Two models grafted, by the weights that an option names.

    Raises:
        ConfigError: a model of another method, or of another family; weights that say nothing on the mesh.
        CheckpointError: there is no such model, or it is damaged.
    """
    from mitex.methods.nca import Graft, NcaTexture
    from mitex.methods.nca.weights import graft_weights

    for model in (first, second):
        if (method := method_of(model)) is not METHOD:
            raise ConfigError(f"'{model}' is a {method.name} texture", f"graft {METHOD.name} textures")
    return Graft(NcaTexture.load(first), NcaTexture.load(second), graft_weights(mesh, weights))
