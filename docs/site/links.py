"""Links of pages to folders of the repository: the site has none of these, and keeps their text."""

from __future__ import annotations

from docutils import nodes
from sphinx.addnodes import pending_xref
from sphinx.application import Sphinx


def leave_text(app: Sphinx, page: nodes.document) -> None:
    """Takes the links to folders out of a page; those that lead nowhere stay, and are errors."""
    for link in list(page.findall(pending_xref)):
        _, path = app.env.relfn2path(link["reftarget"], app.env.docname)
        if link["reftype"] == "myst" and (app.srcdir / path).is_dir():
            link.replace_self(link.children)


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("doctree-read", leave_text)
    return {"parallel_read_safe": True}
