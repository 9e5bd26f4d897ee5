"""Writes the page that `docs/living-page.md` shows in a frame: textures that grow while one reads about them.

It is made anew for each build, so that the site always shows what the program writes.
"""

from __future__ import annotations

from pathlib import Path
from typing import Any

from sphinx.application import Sphinx

PAGE = "docs/living.html"
LOOKS = ("pebbles", "lava", "ceramic")


def write_page(app: Sphinx, error: Exception | None) -> None:
    """Called by Sphinx at the end of a build."""
    if error is not None or app.builder.format != "html":
        return
    from mitex.mesh import embedded
    from mitex.methods.nca import NcaTexture, living_page

    first, *others = (NcaTexture.load(name) for name in LOOKS)
    living_page(first, embedded("knot"), Path(app.outdir, PAGE), looks=others)


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.connect("build-finished", write_page)
    return {"parallel_read_safe": True, "parallel_write_safe": True}
