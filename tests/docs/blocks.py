"""The fenced blocks of the pages, and which of them are not run."""

from __future__ import annotations

import re
import shlex
from dataclasses import dataclass
from pathlib import Path

from markdown_it import MarkdownIt

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted(ROOT.glob("docs/*.md")), *sorted(ROOT.glob("docs/developers/*.md"))]
PAGES += [ROOT / "docs" / "reference" / "settings.md"]
PROGRAMS = ("mitex", "make", "pip", "python", ".venv/bin/python", ".venv/bin/mitex")
MARK = re.compile(r"<!--\s*(not run|part of):\s*(.+?)\s*-->", re.DOTALL)


@dataclass(frozen=True)
class Block:
    """A fenced block.

    Attributes:
        page: Its file.
        line: Where its text begins, counted from 1.
        language: "python", "sh", "toml", ..., or "" for a drawing or an output.
        text: What is in it.
        mark: The comment before it: `<!-- not run: why -->` or `<!-- part of: file -->`, as kind and text.
    """

    page: Path
    line: int
    language: str
    text: str
    mark: tuple[str, str] | None

    @property
    def place(self) -> str:
        """Page and line, for messages."""
        return f"{self.page.relative_to(ROOT)}:{self.line}"

    def commands(self) -> list[list[str]]:
        """The words of each command, without comments, prompts and variables set for it alone."""
        lines = self.text.replace("\\\n", " ").splitlines()
        every = [shlex.split(line.removeprefix("$ "), comments=True) for line in lines]
        plain = [_without_variables(words) for words in every]
        return [words for words in plain if words]


def blocks(page: Path, text: str | None = None) -> list[Block]:
    """The blocks of a page, or of a text that stands for it. A fence without a language that begins with a
    program's name is one of commands.
    """
    tokens = MarkdownIt().parse(page.read_text() if text is None else text)
    fenced = []
    for before, token in zip([None, *tokens], tokens, strict=False):
        if token.type == "fence" and token.map:
            match = MARK.fullmatch(before.content.strip()) if before and before.type == "html_block" else None
            mark = (match[1], match[2]) if match else None
            language = token.info.strip() or _language(token.content)
            fenced.append(Block(page, token.map[0] + 2, language, token.content, mark))
    return fenced


def _language(text: str) -> str:
    return "sh" if text.split(maxsplit=1)[:1] and text.split(maxsplit=1)[0] in PROGRAMS else ""


def _without_variables(words: list[str]) -> list[str]:
    while words and re.match(r"[A-Z_]+=", words[0]):
        words = words[1:]
    return words
