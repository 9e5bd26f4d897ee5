"""`mitex cache`."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Annotated

from tyro.conf import arg

if TYPE_CHECKING:
    from mitex.cache_entries import Entry


@dataclass
class Cache:
    """Show what Mitex keeps on disk so that it need not be computed twice, or clear it.

    The cache keeps to 2 GB, or to what the environment variable MITEX_CACHE_GB says; what was not used for
    longest goes first. It is in ~/.cache/mitex, or where XDG_CACHE_HOME says.

    examples:
      mitex cache
      mitex cache --clear
      MITEX_CACHE_GB=10 mitex cache
    """

    clear: Annotated[bool, arg(help_behavior_hint="")] = False
    """Remove all of it; commands compute it again when they need it."""

    def run(self) -> None:
        from mitex import cache_entries
        from mitex.paths import cache_dir

        most = cache_entries.limit()
        if self.clear:
            print(f"removed {_total(cache_entries.clear())} from {cache_dir()}")
            return
        entries = [*cache_entries.results(), *cache_entries.unfinished()]
        print(f"{cache_dir()}: {_total(entries)}; at most {size_text(most)}")
        for kind in sorted({entry.place.parent.name for entry in entries}):
            print(f"  {kind:10} {_total([entry for entry in entries if entry.place.parent.name == kind])}")


def _total(entries: Sequence[Entry]) -> str:
    noun = "entry" if len(entries) == 1 else "entries"
    return f"{len(entries)} {noun}, {size_text(sum(entry.size for entry in entries))}"


def size_text(size: float) -> str:
    """A number of bytes in words, with three digits at most."""
    for unit, factor in (("GB", 1e9), ("MB", 1e6)):
        if size >= 0.9995 * factor:
            return f"{size / factor:.3g} {unit}"
    return f"{size / 1e3:.3g} KB"
