"""The navigation: which pages there are, in groups, found by their places."""

from __future__ import annotations

from fnmatch import fnmatchcase

from sphinx.application import Sphinx

# Group -> its pages as patterns. A page belongs to the first pattern that it matches.
GROUPS = {
    "Tutorials": ["docs/tutorials/texture-a-mesh", "docs/tutorials/*"],
    "Methods": ["docs/nca", "docs/surface", "docs/geometric", "docs/nerf"],
    "Guides": ["docs/blender", "docs/plugins", "docs/embedding", "docs/settings", "docs/runs", "docs/times"],
    "Reference": ["docs/reference/mitex", "docs/reference/*"],
    "Results": ["docs/results/*"],
    "Developers": ["docs/developers/*", "CONTRIBUTING", "CHANGELOG"],
    "About": ["*"],
}


def groups(pages: set[str], root: str) -> dict[str, list[str]]:
    """The pages of each group in order, each page once; the root is in none."""
    left, grouped = sorted(pages - {root}), {}
    for name, patterns in GROUPS.items():
        grouped[name] = [page for pattern in patterns for page in left if fnmatchcase(page, pattern)]
        grouped[name] = list(dict.fromkeys(grouped[name]))
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
