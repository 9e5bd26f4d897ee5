"""Mesh files: finding, reading, welding, checking."""

from __future__ import annotations

import os
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np

from mitex.errors import MeshError, MeshWarning
from mitex.mesh.embedded import embedded, embedded_names
from mitex.mesh.mesh import Mesh
from mitex.mesh.polygons import Polygons
from mitex.mesh.readers import SUFFIXES, Budget, Soup, read
from mitex.mesh.readers.soup import near_origin
from mitex.mesh.topology import welded
from mitex.mesh.validate import validate
from mitex.paths import encodable, expanded
from mitex.progress import announce
from mitex.suggestions import suggestion


def load(path: str | os.PathLike[str], max_vertices: int = 2_000_000) -> Mesh:
    """Loads a mesh.

    Polygons are cut into triangles and remembered. Vertices that a format splits at seams of UVs or normals
    (always in STL and glTF, sometimes in OBJ and PLY) are welded where their positions are bit-identical, so
    that the graph is connected; UVs and normals stay per face corner, and with them seams and hard edges.
    `Mesh.polygons` remembers which vertices of an OBJ or PLY were. Flaws are handled as `validate` says. glTF
    node transforms are applied. Materials and images are not read.

    Args:
        path: .obj, .ply, .stl, .glb, .gltf or .off; or the name of a mesh that ships with Mitex.
        max_vertices: budget, from which those of corners, parts and bytes follow; a file that goes beyond is
            refused before its content is allocated.

    Returns:
        The mesh, in the file's units, order and place; but one that is more than 1000 times its size away
        from the origin is moved there, since single precision would lose its shape.

    Raises:
        MeshError: missing, unreadable, of an unknown kind, damaged, empty, over budget, or what `validate`
            refuses.
    """
    source = expanded(path)
    if not os.path.exists(source) and str(path) in embedded_names():
        return embedded(str(path))
    budget = Budget(max_vertices)
    _check_file(source, budget.bytes)
    announce(f"reading {source.name}")
    soup = read(source, budget)
    soup.vertices, centre = near_origin(soup.vertices)
    if centre.any():
        soup.notes.append(
            f"it lies far from the origin and was moved there, by {np.round(-centre, 3).tolist()}"
        )
    for note in soup.notes:
        warnings.warn(f"{path}: {note}", MeshWarning, stacklevel=2)
    vertices, faces = weld(soup)
    mesh = validate(
        vertices,
        faces,
        soup.uv,
        name=str(path),
        max_vertices=max_vertices,
        corner_normals=soup.normals,
        polygons=_polygons(soup, len(vertices)),
    )
    return replace(mesh, name=encodable(source.stem))


def weld(soup: Soup) -> tuple[np.ndarray, np.ndarray]:
    """Joins vertices at bit-identical float32 positions, where the file only split them at seams.

    That is so if the format always splits, if no two faces share a vertex, or if the vertices of one place
    differ in UV or normal. Other coincident vertices stay apart: two sheets that touch are not one.

    Returns:
        (V', 3) float32 vertices in order of first appearance and (F, 3) int64 faces.
    """
    with np.errstate(over="ignore"):
        vertices = soup.vertices.astype(np.float32) + np.float32(0.0)  # -0.0 and 0.0 are one place
    if not len(vertices) or not len(soup.faces):
        return vertices, soup.faces
    place = welded(vertices)
    used_once = np.bincount(soup.faces.ravel(), minlength=len(vertices)).max() <= 1
    if soup.split or (used_once and len(soup.faces) > 1):
        joined = np.ones(len(vertices), bool)
    elif soup.attributes is None:
        return vertices, soup.faces
    else:
        kind = welded(np.column_stack([place, soup.attributes]))
        pairs = np.unique(np.stack([place, kind], axis=1), axis=0)
        joined = (np.bincount(pairs[:, 0]) > 1)[place]
    first = np.full(len(vertices), len(vertices))
    np.minimum.at(first, place, np.arange(len(vertices)))
    target = np.where(joined, first[place], np.arange(len(vertices)))
    keep = target == np.arange(len(vertices))
    return vertices[keep], (np.cumsum(keep) - 1)[target[soup.faces]]


def _polygons(soup: Soup, count: int) -> Polygons | None:
    """The polygons of a mesh that was welded to `count` vertices; with the file's own if they say more."""
    if soup.split or count == len(soup.vertices):
        return soup.polygons
    triangles = np.arange(soup.faces.size).reshape(-1, 3)
    polygons = soup.polygons or Polygons(np.full(len(soup.faces), 3), triangles)
    return replace(polygons, vertices=polygons.at_corners(soup.faces))


def _check_file(source: Path, max_bytes: int) -> None:
    formats = ", ".join(SUFFIXES)
    if not os.path.exists(source):  # unlike Path.exists, also answers for impossible names
        names = embedded_names()
        otherwise = f"give a mesh file, or one of {', '.join(names)}"
        raise MeshError(f"there is no mesh {source}", suggestion(str(source), names, otherwise))
    if os.path.isdir(source):
        raise MeshError(f"{source} is a folder", f"name a mesh file ({formats})")
    if not os.path.isfile(source):
        raise MeshError(f"{source} is not a regular file", f"name a mesh file ({formats})")
    if source.suffix.lower() not in SUFFIXES:
        ending = f"'{source.suffix}'" if source.suffix else "no suffix"
        raise MeshError(
            f"{source} has {ending}, which is no mesh format Mitex reads", f"convert it to {formats}"
        )
    size = source.stat().st_size
    if not size:
        raise MeshError(f"{source} is empty (0 bytes)", "export or download it again")
    if size > max_bytes:
        problem = f"{source} is {size >> 20:,} MB, more than {max_bytes >> 20:,} MB"
        raise MeshError(problem, "simplify it, or raise max_vertices")
    try:
        with source.open("rb") as file:
            start = file.read(40)
    except OSError as error:
        raise MeshError(f"{source} cannot be read ({error.strerror})", "check its permissions") from error
    if start.startswith(b"version https://git-lfs"):
        raise MeshError(f"{source} is a Git LFS pointer, not the mesh itself", "run `git lfs pull`")
