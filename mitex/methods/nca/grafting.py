"""`mitex graft`."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from tyro.conf import Positional, arg

from mitex.errors import ConfigError
from mitex.methods.checks import in_range, mutually_exclusive, reject_unused
from mitex.methods.nca import METHOD
from mitex.methods.nca.arguments import RESOLUTION, levels, oriented
from mitex.methods.nca.ranges import BAKED, MOST_STEPS, SPEEDS
from mitex.methods.options import MeshOptions, field_files
from mitex.methods.registry import method_of
from mitex.ranges import SCALES, SEEDS
from mitex.suffixes import PICTURES

if TYPE_CHECKING:
    from pathlib import Path

    from mitex.asset import Asset
    from mitex.mesh import Mesh
    from mitex.methods.nca.graft import Graft


@dataclass(kw_only=True)
class Grafted(MeshOptions):
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

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed."""

    steps: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the slower model's)")] = None
    """Steps of the automaton."""

    subdivide: Annotated[str, arg(metavar="auto|N")] = "auto"
    """How often to subdivide the automaton's copy of the mesh; auto: to the training's density."""

    orientation: Annotated[str, arg(metavar="DEG|FIELD")] = "0"
    """Turns the textures on the surface [degrees], or lets their up follow a vector field (as of --field)."""

    scale: Annotated[float, arg(metavar="X")] = 1.0
    """Size of the patterns."""

    field: Annotated[str | None, arg(metavar="FIELD", help_behavior_hint="(default: the trainings')")] = None
    """Vector field that the textures move along: a name (up, right, about-y, ...), a direction, or a file
    (.npy .ply .json)."""

    speed: Annotated[float, arg(metavar="X")] = 1.0
    """Speed along --field. At 1, the mean is an edge of the automaton's mesh in 6 steps, or as trained."""

    resolution: Annotated[int | None, arg(metavar="N", help_behavior_hint=f"(default: {RESOLUTION})")] = None
    """Side of the baked textures [texels]."""

    vertex_colors: Annotated[bool, arg(help_behavior_hint="")] = False
    """Write colours at the vertices instead of textures."""

    def check(self) -> None:
        levels(self.subdivide)
        in_range("--seed", self.seed, *SEEDS)
        in_range("--steps", self.steps, 1, MOST_STEPS)
        oriented(self.orientation)
        in_range("--scale", self.scale, *SCALES)
        in_range("--speed", self.speed, *SPEEDS)
        in_range("--resolution", self.resolution, *BAKED)
        mutually_exclusive(
            "--resolution", "--vertex-colors", self.resolution is not None and self.vertex_colors
        )

    def inputs(self) -> list:
        return [*super().inputs(), self.second, self.weights, *field_files(self.field, self.orientation)]

    def check_output(self, out: Path) -> None:
        suffix = out.suffix.lower()
        reject_unused(
            "--vertex-colors", out, self.vertex_colors and suffix not in (".glb", ".ply", *PICTURES)
        )
        reject_unused("--resolution", out, self.resolution is not None and suffix == ".ply")

    def applied(self, out: Path) -> Asset:
        from mitex.runtime import let_idle_threads_sleep

        let_idle_threads_sleep()
        from mitex.mesh import Mesh

        mesh = Mesh.load(self.mesh)
        textures = out.suffix.lower() != ".ply" and not self.vertex_colors
        return grafted(self.model, self.second, mesh, self.weights).apply(
            mesh,
            seed=self.seed,
            steps=self.steps,
            subdivide=levels(self.subdivide),
            orientation=oriented(self.orientation),
            scale=self.scale,
            field=self.field,
            speed=self.speed,
            resolution=(self.resolution or RESOLUTION) if textures else None,
        )


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
