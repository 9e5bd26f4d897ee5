"""Records as files, JSON or CSV, each written in one step."""

from __future__ import annotations

import csv
import json
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

from mitex.paths import atomic_write


def write_json(path: Path, record: Mapping[str, Any]) -> None:
    """Writes a JSON object.

    Raises:
        OutputError: The disk is full, or the folder is not writable.
    """
    with atomic_write(path) as temporary:
        temporary.write_text(json.dumps(record, indent=1) + "\n", encoding="utf-8")


def write_csv(path: Path, columns: Sequence[str], rows: Iterable[Mapping[str, Any]]) -> None:
    """Writes a table with a line of headings; what a row lacks is left empty.

    File names that are no valid UTF-8 keep their bytes.

    Raises:
        OutputError: As of `write_json`.
        ValueError: A row has a key that is no column.
    """
    with (
        atomic_write(path) as temporary,
        temporary.open("w", encoding="utf-8", errors="surrogateescape", newline="") as file,
    ):
        writer = csv.DictWriter(file, columns, restval="")
        writer.writeheader()
        writer.writerows(rows)
