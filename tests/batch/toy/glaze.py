"""A method whose options are files, names and words, as their types say; it is never run."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from tyro.conf import arg

from mitex.methods.method import Method
from mitex.methods.option_types import PlainText, TextOf, VectorField
from mitex.methods.options import FitOptions

METHOD = Method(
    name="glaze",
    title="nothing (for tests)",
    presets="stripes:PRESETS",
    fit="glaze:Fit",
    apply="stripes:Apply",
    texture="stripes:Stripes",
)


def colours() -> list[str]:
    return ["cobalt", "copper"]


@dataclass(kw_only=True)
class Fit(FitOptions):
    """Learn nothing.

    examples:
      mitex fit glaze --colour cobalt
    """

    source: ClassVar[str | None] = "colour"

    colour: Annotated[Annotated[str, TextOf(names="glaze:colours")] | None, arg(metavar="IMAGE|NAME")] = None
    """What it learns from."""

    poem: Annotated[PlainText | None, arg(metavar="WORDS")] = None
    """Words."""

    finish: Annotated[Literal["matte"] | str, arg(metavar="matte|IMAGE")] = "matte"
    """A word, or a file."""

    drip: Annotated[VectorField | None, arg(metavar="FIELD")] = None
    """A vector field."""

    mask: Annotated[Path | None, arg(metavar="IMAGE")] = None
    """A file."""

    kiln: Annotated[str | None, arg(metavar="FILE|NAME")] = None
    """A file, or what nobody else knows."""
