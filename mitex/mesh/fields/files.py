"""Vectors at the vertices of a mesh, from files."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitex.errors import ConfigError
from mitex.mesh.fields.strokes import read_strokes, stroke_vectors
from mitex.mesh.mesh import Mesh
from mitex.mesh.vertex_files import read_array, read_properties
from mitex.paths import expanded
from mitex.suffixes import FIELDS as SUFFIXES

PROPERTIES = (("vx", "vy", "vz"), ("fx", "fy", "fz"), ("u", "v", "w"))  # of a PLY file's vertices
MEANING = "vectors"


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
    match place.suffix.lower():
        case ".npy":
            values = read_array(place, MEANING)
        case ".ply":
            _, values = read_properties(place, PROPERTIES, MEANING)
        case ".json":
            values = stroke_vectors(mesh, read_strokes(place))
        case _:
            choices = ", ".join(SUFFIXES)
            raise ConfigError(f"'{place}' is no file of vectors", f"give one that ends in {choices}")
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
