"""Vectors at the vertices of a mesh, from files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitex.errors import ConfigError, MeshError
from mitex.mesh.readers.ply import read_tables

PROPERTIES = (("vx", "vy", "vz"), ("fx", "fy", "fz"), ("u", "v", "w"))  # of a PLY file's vertices
MAX_VERTICES = 2_000_000


def read_npy(place: Path) -> np.ndarray:
    """The array in a NumPy file, of any shape and type, not yet in memory.

    Raises:
        ConfigError: it is damaged, or holds Python objects.
        OSError: it cannot be read.
    """
    try:
        # Mapped: a header that claims more than there is fails before anything is allocated.
        return np.lib.format.open_memmap(place, mode="r")
    except (ValueError, EOFError) as e:
        raise ConfigError(f"'{place}' is not a NumPy array ({e})", "write it with numpy.save") from e


def read_ply(place: Path) -> np.ndarray:
    """(N, 3) float64 vectors of the vertices of a PLY file.

    Raises:
        ConfigError: it is damaged, or its vertices have no properties of those names.
        OSError: it cannot be read.
    """
    try:
        points = read_tables(str(place), place.read_bytes(), MAX_VERTICES)[0].get("vertex", {})
    except MeshError as e:
        raise ConfigError(e.problem, e.remedy) from e
    for names in PROPERTIES:
        columns = [points[name] for name in names if isinstance(points.get(name), np.ndarray)]
        if len(columns) == 3:
            return np.stack(columns, axis=1).astype(np.float64)
    choices = ", ".join(" ".join(names) for names in PROPERTIES)
    raise ConfigError(f"the vertices of '{place}' have no vectors", f"give them properties {choices}")
