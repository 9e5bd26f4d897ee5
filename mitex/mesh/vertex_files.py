"""Values at the vertices of a mesh, from files; not yet checked against the mesh."""

from __future__ import annotations

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from mitex.errors import ConfigError, MeshError
from mitex.mesh.readers import Budget
from mitex.mesh.readers.ply import read_tables
from mitex.paths import expanded
from mitex.reading import content, reading

MAX_VERTICES = 2_000_000


def read_array(path: str | Path, meaning: str) -> np.ndarray:
    """The array of a .npy file, mapped; `meaning` says what it is, in messages.

    Raises:
        ConfigError: there is no such file, or it holds no array of numbers.
    """
    with readable(path, meaning, "is not a NumPy array", "write it with numpy.save") as place:
        # Mapped: a header that claims more than there is fails before anything is allocated.
        return np.lib.format.open_memmap(place, mode="r")


def read_properties(
    path: str | Path, groups: Sequence[tuple[str, ...]], meaning: str
) -> tuple[tuple[str, ...], np.ndarray]:
    """The first group of properties that the vertices of a .ply file have, and its values (V, n) float64.

    Raises:
        ConfigError: there is no such file, it cannot be read, or its vertices have none of the groups.
    """
    budget = Budget(MAX_VERTICES)
    with readable(path, meaning) as place:
        try:
            points = read_tables(str(place), content(place, budget.bytes), budget)[0].get("vertex", {})
        except MeshError as e:
            raise ConfigError(e.problem, e.remedy) from e
    for names in groups:
        columns = [points[name] for name in names if isinstance(points.get(name), np.ndarray)]
        if len(columns) == len(names):
            return names, np.stack(columns, axis=1).astype(np.float64)
    choices = ", ".join(" ".join(names) for names in groups)
    raise ConfigError(f"the vertices of '{place}' have no {meaning}", f"give them properties {choices}")


@contextmanager
def readable(
    path: str | Path, meaning: str, what: str = "cannot be read", remedy: str = "check what wrote it"
) -> Iterator[Path]:
    """A context that reads a file, given its expanded path; `what` and `remedy` are as of `reading`.

    Raises:
        ConfigError: there is no such file, or the context cannot read it.
    """
    place = expanded(path)
    if not os.path.isfile(place):  # unlike Path.is_file, also answers for impossible names
        raise ConfigError(f"there is no file of {meaning} at '{place}'", "check the path")
    with reading(place, ConfigError, remedy, what):
        yield place
