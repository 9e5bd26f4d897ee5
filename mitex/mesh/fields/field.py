"""A vector field of a mesh from its name, a direction, a file or an array, tangent and of mean length 1."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.vectors import across, unit
from mitex.mesh.fields.files import SUFFIXES, checked_vectors, read_vectors
from mitex.mesh.fields.named import NAMES, named_vectors
from mitex.mesh.mesh import Mesh
from mitex.suffixes import names_field_file
from mitex.suggestions import suggestion

FAINT = 1e-5  # parts of a vector along the surface that are shorter, relative to it, are rounding errors


def vector_field(mesh: Mesh, source: str | Path | np.ndarray) -> np.ndarray:
    """A tangent vector at each vertex, of mean length 1.

    MeshNCA's equations 10 and 18: U - (U . n) n with the unit vertex normal n, divided by the mean of the
    lengths over the vertices.

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
    vectors = checked_vectors(label, _vectors(mesh, source), mesh)
    largest = np.abs(vectors).max(initial=0.0)
    if largest == 0.0:
        raise ConfigError(f"{label} is zero everywhere", "give one with a direction somewhere")
    vectors = vectors / largest  # first: squares may overflow
    tangent = across(vectors, unit(mesh.normals.astype(np.float64)))
    lengths = np.linalg.norm(tangent, axis=1)
    faint = lengths <= FAINT * np.linalg.norm(vectors, axis=1)
    if faint.all():
        raise ConfigError(
            f"{label} is normal to the surface of '{mesh.name}' everywhere",
            "give one with a part along the surface",
        )
    tangent[faint], lengths[faint] = 0.0, 0.0
    return (tangent / lengths.mean()).astype(np.float32)


def _vectors(mesh: Mesh, source: str | Path | np.ndarray) -> np.ndarray:
    """The vectors that a source gives."""
    if not isinstance(source, str | Path):
        return np.asarray(source)
    name = str(source)
    if name in NAMES:
        return named_vectors(mesh, name)
    if names_field_file(source):
        return read_vectors(mesh, source)
    if "," in name:
        return np.tile(_direction(name), (len(mesh.vertices), 1))
    files = ", ".join(SUFFIXES)
    everything = f"use one of {', '.join(NAMES)}, a direction such as 1,0,0, or a file ({files})"
    raise ConfigError(f"there is no vector field '{name}'", suggestion(name, NAMES, everything))


def _direction(text: str) -> np.ndarray:
    try:
        numbers = np.array([float(word) for word in text.split(",")])
    except ValueError:
        numbers = np.empty(0)
    if numbers.shape != (3,):
        raise ConfigError(f"'{text}' is no direction", "give three numbers, such as 1,0,0")
    return numbers
