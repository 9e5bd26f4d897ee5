"""The options that say how a geometric texture grows on a mesh."""

from __future__ import annotations

import sys
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

from mitex.cli.checks import in_range

if TYPE_CHECKING:
    from mitex.mesh import Mesh
    from mitex.methods.geometric import GeometricTexture

TEMPLATE = "template"  # as a mesh: the one that the texture's training started from


@dataclass(kw_only=True)
class Displacing:
    """Options shared by `mitex apply` and `mitex animate`."""

    start_level: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: 2)")] = None
    """Geometric textures: the generator to begin with; low ones change the shape."""

    end_level: Annotated[int | None, arg(metavar="N", help_behavior_hint="(default: the last)")] = None
    """Geometric textures: the last generator; each one after the first splits every face in four."""

    remesh: Annotated[int | None, arg(metavar="N", help_behavior_hint="")] = None
    """Geometric textures: give the mesh N even vertices first; fewer make the texture larger."""

    def check_displacing(self) -> None:
        in_range("--start-level", self.start_level, 0, 6)
        in_range("--end-level", self.end_level, 0, 6)
        in_range("--remesh", self.remesh, 12, 2_000_000)

    def even_mesh(self, name: str) -> Mesh:
        """The mesh to be displaced, remeshed if that is asked for."""
        from mitex.mesh import Mesh, remesh

        mesh = Mesh.load(name)
        return mesh if self.remesh is None else remesh(mesh, self.remesh)

    def advise(self, texture: GeometricTexture, mesh: Mesh) -> None:
        """Says, on stderr, how large the texture is on a mesh, and what would change that."""
        size, vertices = texture.relative_size(mesh, self.start_level)
        print(
            f"features are {size:.2g} times as large as on the reference, beside the whole mesh; "
            f"--remesh {vertices} makes them as large",
            file=sys.stderr,
        )
