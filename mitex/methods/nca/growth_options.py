"""The command-line options of `apply`, `graft` and `animate` that say how a texture grows on a mesh."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Annotated, Any

from tyro.conf import arg

from mitex.errors import ConfigError
from mitex.methods.checks import in_range, mutually_exclusive
from mitex.methods.nca.ranges import BAKED, MOST_STEPS, SPEEDS
from mitex.methods.option_types import PlainText, VectorField
from mitex.methods.options import field_files
from mitex.ranges import SCALES, SEEDS, TURNS

RESOLUTION = 1024  # of baked textures [texels]


@dataclass(kw_only=True)
class GrowthOptions:
    """How a texture lies on a mesh, and moves along it."""

    seed: Annotated[int, arg(metavar="N")] = 0
    """Random seed: another seed, another variant of the texture."""

    subdivide: Annotated[PlainText, arg(metavar="auto|N")] = "auto"
    """How often to subdivide the automaton's copy of the mesh; auto: to the training's density."""

    orientation: Annotated[VectorField, arg(metavar="DEG|FIELD")] = "0"
    """Turns the texture on the surface [degrees], or lets its up follow a vector field (as of --field)."""

    scale: Annotated[float, arg(metavar="X")] = 1.0
    """Size of the pattern."""

    field: Annotated[
        VectorField | None, arg(metavar="FIELD", help_behavior_hint="(default: the training's)")
    ] = None
    """Vector field that the texture moves along: a name (up, right, about-y, ...), a direction, or a file
    (.npy .ply .json)."""

    speed: Annotated[float, arg(metavar="X")] = 1.0
    """Speed along --field. At 1, the mean is an edge of the automaton's mesh in 6 steps, or as trained."""

    def check_growth(self) -> None:
        """Refuses values out of range.

        Raises:
            ConfigError: there is one.
        """
        levels(self.subdivide)
        in_range("--seed", self.seed, *SEEDS)
        oriented(self.orientation)
        in_range("--scale", self.scale, *SCALES)
        in_range("--speed", self.speed, *SPEEDS)

    def growth(self) -> dict[str, Any]:
        """What Python takes for these options, but the seed."""
        return {
            "subdivide": levels(self.subdivide),
            "orientation": oriented(self.orientation),
            "scale": self.scale,
            "field": self.field,
            "speed": self.speed,
        }

    def growth_files(self) -> list[str]:
        """Files that hold vector fields."""
        return field_files(self.field, self.orientation)


@dataclass(kw_only=True)
class BakedOptions(GrowthOptions):
    """How long a texture grows, and how fine its maps are."""

    steps: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the model's)")] = None
    """Steps of the automaton; more make the pattern more regular."""

    resolution: Annotated[int | None, arg(metavar="N", help_behavior_hint=f"(default: {RESOLUTION})")] = None
    """Side of the baked textures [texels]."""

    vertex_colours: Annotated[bool, arg(help_behavior_hint="")] = False
    """Write colours at the vertices instead of textures."""

    def check_growth(self) -> None:
        super().check_growth()
        in_range("--steps", self.steps, 1, MOST_STEPS)
        in_range("--resolution", self.resolution, *BAKED)
        mutually_exclusive(
            "--resolution", "--vertex-colours", self.resolution is not None and self.vertex_colours
        )

    def baked(self, suffix: str) -> dict[str, Any]:
        """What Python takes for a file of this kind, but the seed."""
        textures = suffix != ".ply" and not self.vertex_colours
        resolution = (self.resolution or RESOLUTION) if textures else None
        return {"steps": self.steps, "resolution": resolution, **self.growth()}


def oriented(orientation: str) -> float | str:
    """What --orientation means: an angle [degrees], or a vector field.

    Raises:
        ConfigError: an angle out of range.
    """
    try:
        angle = float(orientation)
    except ValueError:
        return orientation
    in_range("--orientation", angle, *TURNS)
    return angle


def levels(subdivide: str) -> int | str:
    """What --subdivide means.

    Raises:
        ConfigError: neither auto nor a number of levels.
    """
    if subdivide == "auto":
        return "auto"
    if subdivide not in list("0123456"):
        raise ConfigError(f"--subdivide cannot be {subdivide!r}", "use auto or a number from 0 to 6")
    return int(subdivide)
