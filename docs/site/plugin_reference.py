"""Docstrings of Mitsuba plugins: Mitsuba's directive `pluginparameters`, and one that shows a docstring.

    .. plugin:: mitex.textures.vertex_field.VertexField

stands below the heading of a plugin, and shows the docstring alone: whoever uses a plugin writes its type
into a scene and never constructs the class.
"""

from __future__ import annotations

import inspect
import re
from typing import Any

from docutils import nodes
from docutils.parsers.rst.directives.tables import ListTable
from docutils.statemachine import StringList
from sphinx.application import Sphinx
from sphinx.util.docutils import SphinxDirective

from mitex.lazy import load

HEADER = ["Parameter", "Type", "Description", "Flags"]


def parameters(text: str) -> list[list[str]]:
    """The rows of a list of parameters, each of name, type, description, and flags ("" where it has none)."""
    rows = re.split(r"^ *\* ", text, flags=re.MULTILINE)[1:]
    cells = [re.split(r"^ *- ", row, flags=re.MULTILINE)[1:] for row in rows]
    return [[" ".join(cell.split()) for cell in row] + [""] * (len(HEADER) - len(row)) for row in cells]


class PluginParameters(ListTable):
    """A list of parameters as a table; their flags, the last column, may be left out."""

    def run(self) -> list[Any]:
        """Called by docutils."""
        lines = []
        for row in [HEADER, *parameters("\n".join(self.content))]:
            lines += ["*"] + [f"  - {cell}" for cell in row]
        self.content = StringList(lines, self.name)
        self.options |= {"header-rows": 1, "widths": [16, 12, 54, 18], "class": ["parameters"]}
        return list(super().run())


class Plugin(SphinxDirective):
    """The docstring of a class, "module.Class"."""

    required_arguments = 1

    def run(self) -> list[nodes.Node]:
        """Called by docutils."""
        module, _, name = self.arguments[0].rpartition(".")
        text = inspect.getdoc(load(f"{module}:{name}")) or ""
        # Mitsuba's own docs make links to types of |int| and the like.
        return self.parse_text_to_nodes(re.sub(r"\|(\w+)\|", r"\1", text))


def setup(app: Sphinx) -> dict[str, Any]:
    """Called by Sphinx."""
    app.add_directive("pluginparameters", PluginParameters)
    app.add_directive("plugin", Plugin)
    return {"parallel_read_safe": True}
