"""Vectors at the vertices of a mesh, from files."""

from __future__ import annotations

import os
from pathlib import Path

import numpy as np

from mitex.errors import ConfigError, MeshError
from mitex.mesh.fields.strokes import read_strokes, stroke_vectors
from mitex.mesh.mesh import Mesh
from mitex.mesh.readers.ply import read_tables
from mitex.paths import expanded

SUFFIXES = (".npy", ".ply", ".json")
PROPERTIES = (("vx", "vy", "vz"), ("fx", "fy", "fz"), ("u", "v", "w"))  # of a PLY file's vertices
MAX_VERTICES = 2_000_000


def read_vectors(mesh: Mesh, path: str | Path) -> np.ndarray:
    """Vectors at the vertices of a mesh from a file, of any length and direction.

    Args:
        mesh: V vertices.
        path: a .npy, .ply or .json file; see `mitex.mesh.fields`.

    Returns:
        (V, 3) float64.

    Raises:
        ConfigError: no such file; one that holds something else than (V, 3) finite numbers, or strokes that
            `stroke_vectors` refuses.
    """
    place = expanded(path)
    if place.suffix.lower() not in SUFFIXES:
        raise ConfigError(f"'{place}' is no file of vectors", f"give one that ends in {', '.join(SUFFIXES)}")
    if not os.path.isfile(place):  # unlike Path.is_file, also answers for impossible names
        raise ConfigError(f"there is no vector field at '{place}'", "check the path")
    try:
        values = _content(mesh, place)
    except OSError as e:
        reason = e.strerror or str(e)
        raise ConfigError(f"'{place}' cannot be read ({reason})", "check its permissions") from e
    return checked_vectors(f"the vector field '{place}'", values, mesh)


def checked_vectors(label: str, vectors: np.ndarray, mesh: Mesh) -> np.ndarray:
    """Vectors at the vertices as float64.

    Raises:
        ConfigError: they are not (V, 3) finite numbers; `label` names them in the message.
    """
    shape = (len(mesh.vertices), 3)
    if vectors.dtype.kind not in "fiu" or vectors.shape != shape:
        raise ConfigError(
            f"{label} is {vectors.dtype} {vectors.shape}",
            f"give numbers of shape {shape}, a vector for each vertex of '{mesh.name}'",
        )
    vectors = np.array(vectors, np.float64)
    bad = ~np.isfinite(vectors).all(axis=1)
    if bad.any():
        raise ConfigError(
            f"{label} is NaN or infinite at {bad.sum():,} of {shape[0]:,} vertices (first: {bad.argmax()})",
            "use zeros where it is unknown",
        )
    return vectors


def _content(mesh: Mesh, place: Path) -> np.ndarray:
    """What a file says, not yet checked."""
    match place.suffix.lower():
        case ".npy":
            return _read_npy(place)
        case ".ply":
            return _read_ply(place)
        case _:
            return stroke_vectors(mesh, read_strokes(place))


def _read_npy(place: Path) -> np.ndarray:
    try:
        # Mapped: a header that claims more than there is fails before anything is allocated.
        return np.lib.format.open_memmap(place, mode="r")
    except (ValueError, EOFError) as e:
        raise ConfigError(f"'{place}' is not a NumPy array ({e})", "write it with numpy.save") from e


def _read_ply(place: Path) -> np.ndarray:
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
