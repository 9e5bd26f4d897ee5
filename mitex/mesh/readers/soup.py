"""What a mesh file says, before it is checked and cleaned."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from mitex.errors import MeshError
from mitex.mesh.polygons import Polygons, triangulate

FAR = 1e3  # sizes of a mesh: there its positions keep four digits of float32's seven
DAMAGED = "the file is damaged or cut off; export or download it again"


@dataclass(eq=False)
class Soup:
    """Triangles as read.

    Attributes:
        vertices: (V, 3) float64 positions, maybe not finite.
        faces: (F, 3) int64 indices in [0, V).
        uv: (F, 3, 2) float64 corner UVs, v up, or None.
        normals: (F, 3, 3) float64 corner normals of any length, or None.
        polygons: those that the triangles were cut from, or None where all were triangles.
        attributes: (V, k) float64 per-vertex UVs and normals, or None. Coincident vertices that differ in
            them were one vertex before a seam split it.
        split: the format always splits vertices at seams.
        notes: what the reader left out, one sentence each.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None = None
    normals: np.ndarray | None = None
    polygons: Polygons | None = None
    attributes: np.ndarray | None = None
    split: bool = False
    notes: list[str] = field(default_factory=list)


def polygon_soup(
    name: str,
    vertices: np.ndarray,
    corners: np.ndarray,
    sizes: np.ndarray,
    uv: np.ndarray | None = None,
    normals: np.ndarray | None = None,
) -> Soup:
    """Triangulates polygons, at their positions in float32, so that those of an exported mesh are cut alike.

    Args:
        name: for messages.
        vertices: (V, 3) positions.
        corners: (N,) vertex index of every polygon corner, polygon after polygon.
        sizes: (P,) number of corners of each polygon; those with fewer than 3 are left out.
        uv: (N, 2) per corner, or None.
        normals: (N, 3) per corner, or None.

    Raises:
        MeshError: a corner is not in [0, V).
    """
    check_indices(name, corners, len(vertices))
    short = sizes < 3
    if short.any():
        used = np.repeat(~short, sizes)
        corners, sizes = corners[used], sizes[~short]
        uv, normals = (None if values is None else values[used] for values in (uv, normals))
    triangles = triangulate(near_origin(vertices)[0].astype(np.float64), corners, sizes)
    soup = Soup(vertices, corners[triangles])
    soup.uv, soup.normals = (None if values is None else values[triangles] for values in (uv, normals))
    if (sizes > 3).any():
        soup.polygons = Polygons(sizes, triangles)
    if short.any():
        soup.notes.append(f"left out faces with fewer than 3 corners: {short.sum():,}")
    return soup


def near_origin(vertices: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Positions in single precision; far from the origin they are moved there, so that they keep their shape.

    Args:
        vertices: (V, 3) float64, maybe not finite.

    Returns:
        (V, 3) float32, and the (3,) float64 centre that was subtracted: zero unless the box of the vertices
        is `FAR` times farther away than it is large.
    """
    with np.errstate(over="ignore", invalid="ignore"):
        low, high = vertices.min(axis=0, initial=np.inf), vertices.max(axis=0, initial=-np.inf)
        centre, size = low / 2 + high / 2, float((high - low).max())
        if not (np.abs(centre).max() > FAR * size > 0 and np.isfinite(centre).all()):
            centre = np.zeros(3)
        return (vertices - centre).astype(np.float32), centre


def check_indices(name: str, corners: np.ndarray, count: int) -> None:
    """Raises MeshError unless all of `corners` are in [0, count)."""
    if not corners.size:
        return
    low, high = int(corners.min()), int(corners.max())
    if low < 0:
        raise MeshError(f"{name} has a face with the negative vertex index {low}", DAMAGED)
    if high >= count:
        problem = f"{name} has a face that refers to vertex {high} (counted from 0) of only {count}"
        raise MeshError(problem, DAMAGED)
