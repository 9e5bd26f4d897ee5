"""Pieces of pages that work offline: templates, pictures inside the text, numbers as people write them."""

from __future__ import annotations

from collections.abc import Iterable
from html import escape
from importlib.resources import files
from string import Template

from mitex.page import data_url

DASH = "–"
QUALITY = 92  # of the exemplars' JPEGs


def template(name: str) -> Template:
    """A page of this package, to be filled."""
    return Template(text_of(name))


def text_of(name: str) -> str:
    """The text of a file of this package's pages."""
    return files("mitex.comparison").joinpath("pages", name).read_text(encoding="utf-8")


def picture(content: bytes, description: str, attributes: str = "") -> str:
    """An image element of the bytes of a JPEG file."""
    return f'<img src="{data_url(content)}" alt="{escape(description)}"{attributes}>'


def items(texts: Iterable[str]) -> str:
    """List items of plain texts."""
    return "".join(f"<li>{escape(text)}</li>" for text in texts)


def number_text(value: float, digits: int = 3) -> str:
    """A number with some significant digits."""
    size = abs(value)
    if size == 0 or size >= 10 ** (digits - 1):
        text = f"{size:,.0f}"
    else:
        text = f"{size:.1e}" if size < 1e-3 else f"{size:#.{digits}g}".rstrip(".")
    return f"−{text}" if value < 0 else text


def count_text(count: int, noun: str) -> str:
    """A count with its noun, `1 seed` or `3 seeds`."""
    return f"{count} {noun}{'' if count == 1 else 's'}"
