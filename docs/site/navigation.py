"""The navigation: which pages there are, in groups, found by their places."""

from __future__ import annotations

from sphinx.application import Sphinx
from sphinx.util.matching import patfilter

# Group -> its pages as patterns, whose `*` ends at a slash. A page belongs to the first that it matches.
GROUPS = {
    "Tutorials": ["docs/tutorials/texture-a-mesh", "docs/tutorials/*"],
    "Methods": ["docs/nca", "docs/surface", "docs/relief", "docs/geometric", "docs/nerf"],
    "Guides": [
        "docs/moving",
        "docs/living-page",
        "docs/batch",
        "docs/compare",
        *(f"docs/{name}" for name in ("blender", "plugins", "embedding", "runs", "times")),
        "docs/*",
    ],
    "Reference": ["docs/reference/settings", "docs/reference/mitex", "docs/reference/*"],
    "Results": ["docs/results/*"],
    "Developers": ["docs/developers/*", "CONTRIBUTING", "CHANGELOG"],
    "About": ["*"],
}


def groups(pages: set[str], root: str) -> dict[str, list[str]]:
    """The pages of each group in order, each page once; the root is in none."""
    left, grouped = sorted(pages - {root}), {}
    for name, patterns in GROUPS.items():
        matches = [page for pattern in patterns for page in patfilter(left, pattern)]
        grouped[name] = list(dict.fromkeys(matches))
        left = [page for page in left if page not in grouped[name]]
    return {name: members for name, members in grouped.items() if members}


def add_toctrees(app: Sphinx, docname: str, source: list[str]) -> None:
    """Appends the navigation to the root page, whose file stays free of it."""
    if docname != app.config.root_doc:
        return
    for name, pages in groups(set(app.project.docnames), docname).items():
        source[0] += "\n".join(["", "```{toctree}", ":hidden:", f":caption: {name}", "", *pages, "```", ""])


def setup(app: Sphinx) -> dict[str, bool]:
    """Called by Sphinx."""
    app.connect("source-read", add_toctrees)
    return {"parallel_read_safe": True}
