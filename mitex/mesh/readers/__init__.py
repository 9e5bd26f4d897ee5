"""Mesh file formats."""

from __future__ import annotations

from functools import partial
from pathlib import Path

from mitex.mesh.readers.gltf import read_gltf
from mitex.mesh.readers.obj import read_obj
from mitex.mesh.readers.ply import read_ply
from mitex.mesh.readers.soup import Soup
from mitex.mesh.readers.stl_off import read_off, read_stl

SUFFIXES = (".glb", ".gltf", ".obj", ".off", ".ply", ".stl")

__all__ = ["SUFFIXES", "Soup", "read"]


def read(path: Path, max_vertices: int, max_bytes: int) -> Soup:
    """Reads the file `path`, whose suffix is one of `SUFFIXES`.

    Raises:
        MeshError: it cannot be understood, or has more than `max_vertices` vertices.
        OSError: it cannot be read.
    """
    gltf = partial(read_gltf, folder=path.parent, max_bytes=max_bytes)
    readers = {".glb": gltf, ".gltf": gltf, ".obj": read_obj, ".off": read_off, ".ply": read_ply}
    reader = readers.get(path.suffix.lower(), read_stl)
    return reader(str(path), path.read_bytes(), max_vertices)
