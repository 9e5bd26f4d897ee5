"""A vector field of a mesh from its name, a direction, a file or an array, tangent and of mean length 1."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.vectors import across, unit
from mitex.mesh.fields.files import read_npy, read_ply
from mitex.mesh.fields.named import NAMES, named_vectors
from mitex.mesh.fields.strokes import read_strokes, stroke_vectors
from mitex.mesh.mesh import Mesh
from mitex.paths import expanded
from mitex.suggestions import suggestion

READERS = {".npy": read_npy, ".ply": read_ply, ".json": read_strokes}
FAINT = 1e-5  # parts of a vector along the surface that are shorter, relative to it, are rounding errors


def vector_field(mesh: Mesh, source: str | Path | np.ndarray) -> np.ndarray:
    """A tangent vector at each vertex, of mean length 1.

    MeshNCA's equations 10 and 18: U_t = U - (U . n) n with the unit vertex normal n, divided by the mean of
    |U_t| over the vertices.

    Args:
        mesh: V vertices.
        source: a name, a direction such as "1,0,0", a file, or an array (V, 3); see `mitex.mesh.fields`.

    Returns:
        (V, 3) float32, across `mesh.normals`.

    Raises:
        ConfigError: no such name or file; a file or an array that is none of (V, 3) finite numbers; a field
            that is zero, or normal to the surface, at all vertices.
        MeshError: all vertices are at one point.
    """
    label = "the vector field" if isinstance(source, np.ndarray) else f"the vector field '{source}'"
    vectors = _checked(label, _vectors(mesh, source), mesh)
    largest = np.abs(vectors).max(initial=0.0)
    if largest == 0.0:
        raise ConfigError(f"{label} is zero everywhere", "give one that moves something")
    vectors = vectors / largest  # first: squares may overflow
    tangent = across(vectors, unit(mesh.normals.astype(np.float64)))
    lengths = np.linalg.norm(tangent, axis=1)
    faint = lengths <= FAINT * np.linalg.norm(vectors, axis=1)
    if faint.all():
        raise ConfigError(
            f"{label} is normal to the surface of '{mesh.name}' everywhere, so nothing moves along it",
            "give one with a part along the surface",
        )
    tangent[faint], lengths[faint] = 0.0, 0.0
    return (tangent / lengths.mean()).astype(np.float32)


def _vectors(mesh: Mesh, source: Any) -> np.ndarray:
    """The vectors that a source gives, not yet checked."""
    if not isinstance(source, str | Path):
        return np.asarray(source)
    name, suffix = str(source), Path(source).suffix.lower()
    if name in NAMES:
        return named_vectors(mesh, name)
    if suffix in READERS:
        return _of_file(mesh, expanded(source), READERS[suffix])
    if "," in name:
        return np.tile(_direction(name), (len(mesh.vertices), 1))
    files = ", ".join(READERS)
    everything = f"use one of {', '.join(NAMES)}, a direction such as 1,0,0, or a file ({files})"
    raise ConfigError(f"there is no vector field '{name}'", suggestion(name, NAMES, everything))


def _of_file(mesh: Mesh, place: Path, reader: Callable[[Path], Any]) -> np.ndarray:
    if not os.path.isfile(place):  # unlike Path.is_file, also answers for impossible names
        raise ConfigError(f"there is no vector field at '{place}'", "check the path")
    try:
        content = reader(place)
    except OSError as e:
        reason = e.strerror or str(e)
        raise ConfigError(f"'{place}' cannot be read ({reason})", "check its permissions") from e
    return stroke_vectors(mesh, content) if reader is read_strokes else content


def _direction(text: str) -> np.ndarray:
    try:
        numbers = np.array([float(word) for word in text.split(",")])
    except ValueError:
        numbers = np.empty(0)
    if numbers.shape != (3,):
        raise ConfigError(f"'{text}' is no direction", "give three numbers, such as 1,0,0")
    return numbers


def _checked(label: str, vectors: np.ndarray, mesh: Mesh) -> np.ndarray:
    """The vectors as float64, if they are finite numbers of the mesh."""
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
            f"{label} is NaN or infinite at {bad.sum():,} of {shape[0]:,} vertices (first: "
            f"{int(bad.argmax())})",
            "use zeros where it is unknown",
        )
    return vectors
