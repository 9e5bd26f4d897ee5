"""Checks a built site: its links lead somewhere, and reading it asks no other machine for anything.

usage: python docs/site/check.py out/docs

Sphinx checks what pages say; this looks at the HTML that a browser gets, themes and all.
"""

from __future__ import annotations

import re
import sys
from html.parser import HTMLParser
from pathlib import Path
from urllib.parse import unquote, urlsplit

# What a browser fetches by itself, as (tag, attribute); an <a> waits for a click.
FETCHED = {
    ("script", "src"),
    ("img", "src"),
    ("link", "href"),
    ("source", "src"),
    ("iframe", "src"),
    ("video", "src"),
}
IN_STYLES = re.compile(r"""(?:url\(|@import)\s*["']?(?:https?:)?//""")


class Page(HTMLParser):
    """The links of one page, what it fetches, and the anchors that it offers."""

    def __init__(self, text: str) -> None:
        super().__init__()
        self.links: list[str] = []
        self.fetched: list[str] = []
        self.anchors: set[str] = set()
        self.feed(text)

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        """Called by the parser."""
        for name, value in attrs:
            if value and name in ("id", "name"):
                self.anchors.add(value)
            elif value and (tag, name) in FETCHED:
                self.fetched.append(value)
            elif value and (tag, name) == ("a", "href"):
                self.links.append(value)


def faults(site: Path) -> list[str]:
    """What is wrong with the site in a folder, a line for each fault; empty if nothing is."""
    pages = {path.resolve(): Page(path.read_text()) for path in sorted(site.rglob("*.html"))}
    lines = []
    for path, page in pages.items():
        where = path.relative_to(site.resolve())
        lines += [f"{where}: fetches {url}" for url in page.fetched if urlsplit(url).netloc]
        lines += [
            f"{where}: {link} leads nowhere"
            for link in page.links + page.fetched
            if _broken(link, path, pages)
        ]
    styles = [path for path in sorted(site.rglob("*.css")) if IN_STYLES.search(path.read_text())]
    return lines + [f"{path.relative_to(site)}: a style fetches from the network" for path in styles]


def _broken(link: str, path: Path, pages: dict[Path, Page]) -> bool:
    parts = urlsplit(link)
    if parts.scheme or parts.netloc:
        return False
    target = (path.parent / unquote(parts.path)).resolve() if parts.path else path
    if target in pages and parts.fragment:
        return unquote(parts.fragment) not in pages[target].anchors
    return not target.is_file()


def main(site: str) -> int:
    """Prints the faults of a site; 1 if it has any, or is none."""
    lines = faults(Path(site)) if (Path(site) / "index.html").is_file() else [f"{site} is no site"]
    sys.stderr.writelines(f"{line}\n" for line in lines)
    return int(bool(lines))


if __name__ == "__main__":
    sys.exit(main(sys.argv[1]))
