"""Mesh file formats."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from mitex.errors import MeshError
from mitex.mesh.readers.budget import Budget
from mitex.mesh.readers.gltf import read_gltf
from mitex.mesh.readers.obj import read_obj
from mitex.mesh.readers.ply import read_ply
from mitex.mesh.readers.soup import DAMAGED, Soup
from mitex.mesh.readers.stl_off import read_off, read_stl
from mitex.reading import content, reading

SUFFIXES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")

__all__ = ["SUFFIXES", "Budget", "Soup", "read"]


def read(path: Path, budget: Budget) -> Soup:
    """Reads the file `path`, whose suffix is one of `SUFFIXES`, in time proportional to it.

    Raises:
        MeshError: it cannot be read or understood, or goes beyond the budget.
    """
    gltf = partial(read_gltf, folder=path.parent)
    readers = {".glb": gltf, ".gltf": gltf, ".obj": read_obj, ".off": read_off, ".ply": read_ply}
    reader = readers.get(path.suffix.lower(), read_stl)
    kind = path.suffix[1:].upper().replace("GLB", "glTF").replace("GLTF", "glTF")
    with reading(path, MeshError, DAMAGED, f"is not valid {kind}"):
        return reader(str(path), content(path, budget.bytes), budget)
