"""Writes docs/reference/settings.md: every setting of every method, as the dataclasses declare them.

usage: python tools/make_settings_page.py
"""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path

from mitex.methods.method import Method
from mitex.methods.registry import PACKAGES, methods
from mitex.training.settings import rows

PAGE = Path(__file__).parents[1] / "docs" / "reference" / "settings.md"
INTRODUCTION = """\
# Settings

Every method has settings that shape a fit. A preset gives each of them a value, and `--set` changes single
ones: `mitex fit nca --exemplar cobblestone --set density=48 samples=512`. These two commands print the
table of a method, first with the values of its default preset, then with those of another one:

```sh
mitex fit nca --settings
mitex fit nca --settings --preset paper
```

In Python the same settings go to `fit` as `set={"density": 48, "samples": 512}`. A TOML file with any
of them can be named with `--config`. Every run folder keeps the settings of its fit in `config.toml`, which
`--config` reads as well.

Lists are written with commas (`layers=relu1_1,relu2_1`), and an empty list with nothing after the equals
sign. A switch is `true` or `false`. A value that is out of its range, or a name that does not exist, is
refused before any work begins.

In the tables below, the first column of values is that of the default preset. The columns of other presets
show only what differs from it. Units stand in brackets. "The paper" is the publication that the method
comes from.

This page is written by `python tools/make_settings_page.py`, from the settings as the program declares
them.
"""


def page() -> str:
    """The text of docs/reference/settings.md, for the methods that ship with Mitex."""
    built_in = [method for method in methods().values() if method.presets.startswith(PACKAGES)]
    return "\n".join([INTRODUCTION, *(line for method in built_in for line in section(method))])


def section(method: Method) -> Iterator[str]:
    """The lines of one method."""
    presets = method.load_presets()
    tables = {name: rows(preset) for name, preset in presets.items()}
    default, *others = tables.values()
    yield f"## {method.name}\n"
    yield f"`mitex fit {method.name}`: {method.title}.\n"
    yield line(["setting", *(f"`{name}`" for name in presets), "can be", "meaning"])
    yield line(["---"] * (len(presets) + 3))
    for row, *rest in zip(default, *others, strict=True):
        if row.name != "preset":
            differing = [code(other.value) if other.value != row.value else "" for other in rest]
            yield line([code(row.name), code(row.value), *differing, row.allowed, row.meaning])
    yield ""


def line(cells: Iterable[str]) -> str:
    """A row of a Markdown table."""
    return f"| {' | '.join(cell.replace('|', chr(92) + '|') for cell in cells)} |"


def code(text: str) -> str:
    """A value in the type of code, the items of a list one by one, so that a long list breaks."""
    return ", ".join(f"`{item}`" for item in text.split(",")) if text else "an empty list"


if __name__ == "__main__":
    PAGE.write_text(page(), encoding="utf-8")
    print(PAGE)
