"""`mitex view`."""

from __future__ import annotations

import webbrowser
from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from tyro.conf import Positional, arg

from mitex.cli.usage import UsageError
from mitex.lazy import load
from mitex.methods.registry import method_of

if TYPE_CHECKING:
    from mitex.page import Content

ASSETS = (".glb", ".obj", ".ply")
SPHERE = 32  # of an icosphere: 10,242 vertices
MOST_POINTS = 400  # of a loss curve


@dataclass(kw_only=True)
class View:
    """Look at an asset, or at a texture as it grows, in the browser of this machine. Ctrl-C ends it.

    A run that is still training shows its newest checkpoint, and how its loss falls.

    examples:
      mitex view bunny.glb
      mitex view pebbles --mesh bunny.obj
      mitex view runs/pebbles --no-browser
    """

    source: Annotated[Positional[str], arg(metavar="ASSET|RUN|MODEL")]
    """File that `mitex apply` wrote (.glb .obj .ply), run folder, model file, or name of a bundled model."""

    mesh: Annotated[str | None, arg(metavar="MESH|NAME", help_behavior_hint="(default: vase)")] = None
    """What a texture grows on, beside a sphere."""

    no_browser: Annotated[bool, arg(help_behavior_hint="")] = False
    """Print the address, and open nothing."""

    quiet: Annotated[bool, arg(help_behavior_hint="")] = False
    """Show no progress."""

    def run(self) -> None:
        page, news = self.content()
        from mitex.page.server import PageServer

        with PageServer(lambda: page().html(), news) as server:
            print(server.url, flush=True)
            if not self.no_browser:
                webbrowser.open(server.url)
            with suppress(KeyboardInterrupt):  # the usual end
                server.serve_forever()

    def content(self) -> tuple[Callable[[], Content], Callable[[], Any]]:
        """What gives the page and what is new in it.

        Raises:
            UsageError: textures of this method do not grow in a page.
            MitexError: the source or the mesh cannot be read.
        """
        if Path(self.source).suffix.lower() in ASSETS:
            return self._asset()
        method = method_of(self.source)
        if method.page is None:
            raise UsageError(
                f"{method.name} textures do not grow in a page",
                f"apply it first: mitex apply {self.source} --mesh MESH --out asset.glb",
            )
        return self._texture(load(method.page))

    def _asset(self) -> tuple[Callable[[], Content], Callable[[], Any]]:
        from mitex.asset import Asset
        from mitex.page import still_content

        content = still_content(Asset.load(self.source))
        return lambda: content, dict

    def _texture(self, contents: Callable[..., Content]) -> tuple[Callable[[], Content], Callable[[], Any]]:
        from mitex.mesh import Mesh, icosphere
        from mitex.training.locate import METRICS
        from mitex.training.metrics import losses

        meshes = [Mesh.load(self.mesh or "vase"), icosphere(SPHERE)]
        run = Path(self.source)
        if not run.is_dir():
            content = contents([self.source], meshes)
            return lambda: content, dict
        contents([self.source], meshes[:1])  # says what is wrong before a browser opens

        def news() -> dict[str, Any]:
            return {
                "looks": contents([self.source], meshes[:1]).data["looks"],
                "loss": losses(run / METRICS, MOST_POINTS),
            }

        return lambda: contents([self.source], meshes).extended(live="news", **news()), news
