"""`mitex gallery`."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from mitex.cli.models import listing
from mitex.lazy import load
from mitex.methods.registry import methods

MESHES = ("knot", "shaderball", "octopus")
SIDE = 144  # of a thumbnail [px]


@dataclass(kw_only=True)
class Gallery:
    """Write a page with all textures that ship with Mitex: one click grows each of them on a mesh.

    examples:
      mitex gallery --out gallery.html
      mitex gallery --mesh bunny.obj --out gallery.html
    """

    out: Annotated[Path, arg(metavar="FILE")]
    """Page to write (.html)."""

    mesh: Annotated[str | None, arg(metavar="MESH|NAME", help_behavior_hint="(default: three)")] = None
    """What they grow on, instead of meshes that ship with Mitex."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        from mitex.mesh.files import mesh_files
        from mitex.paths import prepare_output

        inputs = [] if self.mesh is None else mesh_files(self.mesh)
        out = prepare_output(self.out, (".html",), inputs=inputs)
        from mitex.mesh import Mesh
        from mitex.page import Content, thumbnail

        meshes = [Mesh.load(name) for name in ([self.mesh] if self.mesh else MESHES)]
        method, page = next((method, method.page) for method in methods().values() if method.page)
        models = [model for model in listing() if model["method"] == method.name]
        pictures = [model["thumbnail"] and thumbnail(Path(model["thumbnail"]), SIDE) for model in models]
        content = load(page)([model["name"] for model in models], meshes)
        Content("Gallery", content.extended(thumbnails=pictures).data).write(out)
        print(self.out)
