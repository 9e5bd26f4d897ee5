"""`mitex gallery`."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Annotated, Any

from tyro.conf import arg

from mitex.cli.models import listing
from mitex.lazy import load
from mitex.methods.registry import methods

MESHES = ("knot", "shaderball", "octopus")
SIDE = 144  # of a thumbnail [px]


@dataclass(kw_only=True)
class Gallery:
    """Write a page with all textures that ship with Mitex: one click grows each of them on a mesh. Those that
    do not grow in a page are shown as they are on a ring.

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
        from mitex.page import Content

        meshes = [Mesh.load(name) for name in ([self.mesh] if self.mesh else MESHES)]
        models = listing()
        method = next(method for method in methods().values() if method.page)
        growing = [model for model in models if model["method"] == method.name]
        assert method.page is not None
        content = load(method.page)([model["name"] for model in growing], meshes)
        content = content.extended(
            thumbnails=[_thumbnail(model) for model in growing],
            stills=[*_stills(model for model in models if model not in growing)],
        )
        Content("Gallery", content.data).write(out)
        print(self.out)


def _thumbnail(model: dict[str, Any]) -> str | None:
    from mitex.page import thumbnail

    return model["thumbnail"] and thumbnail(Path(model["thumbnail"]), SIDE)


def _stills(models: Iterable[dict[str, Any]]) -> Iterator[dict[str, Any]]:
    """Models as an example of their method shows them."""
    from mitex.page.still import still_data

    for model in models:
        method = methods()[model["method"]]
        if method.example is not None:
            asset = load(method.example)(method.load_texture().load(model["path"]))
            yield still_data(replace(asset, name=model["name"])) | {"thumbnail": _thumbnail(model)}
