"""The mesh that everything else works on: positions, faces, values at corners, and what follows from them."""

from __future__ import annotations

import os
from collections.abc import Iterator, Mapping
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from mitex.errors import MeshError
from mitex.geometry.constant import constant, sealed
from mitex.geometry.triangles import triangle_crosses
from mitex.geometry.vectors import scatter_add, unit_normals
from mitex.mesh.polygons import Polygons
from mitex.mesh.topology import EdgeGraph, edge_graph

UNIT = 1e-3  # how far the length of a normal may be from 1
SMOOTH = 1e-6  # normals that differ less from the smooth ones are those
SIMILAR = 1e-5  # how far moved vertices may be from a shifted and scaled mesh [of its extent]


@dataclass(frozen=True, eq=False)
class Mesh:
    """A triangle mesh. Immutable: its arrays are read-only, and copies of what can be changed elsewhere.

    Attributes:
        vertices: (V, 3) float32 positions, finite [mesh units].
        faces: (F, 3) int32 vertex indices in [0, V), counter-clockwise seen from outside.
        uv: (F, 3, 2) float32 texture coordinates per face corner, so that UV seams never split vertices, or
            None; v points up, (0, 0) is the lower left corner of the image.
        name: for messages and file names.
        corner_normals: (F, 3, 3) float32 unit normals that the face corners are shaded with, so that hard
            edges never split vertices, or None for the smooth `normals`.
        polygons: those that the triangles were cut from, or None where all were triangles of these vertices.

    Raises:
        MeshError: An array has the wrong shape, an index is out of range, or a number is not finite.
    """

    vertices: np.ndarray
    faces: np.ndarray
    uv: np.ndarray | None = None
    name: str = "mesh"
    corner_normals: np.ndarray | None = None
    polygons: Polygons | None = None

    def __post_init__(self) -> None:
        for name in ("vertices", "uv", "corner_normals"):
            values = getattr(self, name)
            with np.errstate(over="ignore", invalid="ignore"):
                values = None if values is None else constant(values, np.float32)
            object.__setattr__(self, name, values)
        object.__setattr__(self, "faces", np.asarray(self.faces))
        for problem, remedy in _problems(self):
            raise MeshError(f"{self.name}: {problem}", remedy)
        object.__setattr__(self, "faces", constant(self.faces, np.int32))

    @staticmethod
    def load(path: str | os.PathLike[str], max_vertices: int = 2_000_000) -> Mesh:
        """Loads a mesh file; see `mitex.mesh.load`."""
        from mitex.mesh.load import load

        return load(path, max_vertices)

    @staticmethod
    def of(source: Mesh | str | os.PathLike[str]) -> Mesh:
        """A mesh as it is, or that which `load` reads."""
        return source if isinstance(source, Mesh) else Mesh.load(source)

    @cached_property
    def edges(self) -> EdgeGraph:
        """The vertex neighbourhoods: directed edges j -> i, grouped by the receiving vertex i."""
        return edge_graph(self.faces, len(self.vertices))

    @cached_property
    def edge_lengths(self) -> np.ndarray:
        """(V,) float64 mean lengths of the edges at each vertex; of all edges where they have none [mesh
        units].
        """
        graph = self.edges
        lengths = np.linalg.norm(self.vertices[graph.indices] - self.vertices[graph.rows], axis=1)
        total = np.bincount(graph.rows, lengths, len(self.vertices))
        mean = float(lengths.mean()) if len(lengths) else 1.0
        return sealed(np.where(total > 0, total / np.maximum(graph.valence, 1), mean))

    @cached_property
    def face_crosses(self) -> np.ndarray:
        """(F, 3) float64 normals whose lengths are twice the faces' areas [mesh units^2]."""
        return sealed(triangle_crosses(self.vertices[self.faces].astype(np.float64)))

    @cached_property
    def face_areas(self) -> np.ndarray:
        """(F,) float32 areas [mesh units^2]."""
        return sealed((0.5 * np.linalg.norm(self.face_crosses, axis=1)).astype(np.float32))

    @cached_property
    def face_normals(self) -> np.ndarray:
        """(F, 3) float32 unit normals; +z where a face has no area."""
        return sealed(unit_normals(self.face_crosses).astype(np.float32))

    @cached_property
    def normals(self) -> np.ndarray:
        """(V, 3) float32 unit normals, the area-weighted mean of the faces around; +z where that is zero."""
        crosses = np.repeat(self.face_crosses, 3, axis=0)
        total = scatter_add(self.faces.ravel(), crosses, len(self.vertices))
        return sealed(unit_normals(total).astype(np.float32))

    @property
    def shading_normals(self) -> np.ndarray:
        """(F, 3, 3) float32 unit normals that corners are shaded with: `corner_normals`, or smooth ones."""
        return self.normals[self.faces] if self.corner_normals is None else self.corner_normals

    def with_shading_normals(self, normals: np.ndarray) -> Mesh:
        """The mesh shaded with (F, 3, 3) unit normals, which are left out if they are the smooth ones."""
        smooth = np.abs(normals - self.normals[self.faces]).max(initial=0.0) <= SMOOTH
        return replace(self, corner_normals=None if smooth else normals)

    def normalised(self) -> tuple[Mesh, Similarity]:
        """The mesh with its vertex mean at the origin and its farthest vertex at distance 1.

        Returns:
            The mesh, and the similarity that was applied.

        Raises:
            MeshError: All vertices are at one point.
        """
        positions = self.vertices.astype(np.float64)
        centre = positions.mean(axis=0)
        scale = float(np.linalg.norm(positions - centre, axis=1).max())
        if scale == 0.0:
            raise MeshError(f"all vertices of {self.name} are at one point", "check how it was exported")
        similarity = Similarity(centre, scale)
        return self.with_vertices(similarity.apply(positions)), similarity

    def with_vertices(self, vertices: np.ndarray) -> Mesh:
        """The same faces, UVs, polygons and edges with other positions, (V, 3).

        Corner normals stay if the mesh is only moved and scaled: they belong to its shape.

        Raises:
            MeshError: not one position for each vertex.
        """
        if np.shape(vertices) != self.vertices.shape:
            problem = f"{self.name} has vertices of shape {self.vertices.shape}, not {np.shape(vertices)}"
            raise MeshError(problem, "give one position per vertex")
        normals = self.corner_normals
        if normals is not None and not _are_similar(self.vertices, np.asarray(vertices)):
            normals = None
        mesh = replace(self, vertices=vertices, corner_normals=normals)
        if "edges" in self.__dict__:
            mesh.__dict__["edges"] = self.edges
        return mesh

    def __repr__(self) -> str:
        uv = "" if self.uv is None else ", with uv"
        return f"Mesh({self.name!r}, {len(self.vertices)} vertices, {len(self.faces)} faces{uv})"


@dataclass(frozen=True, eq=False)
class Similarity:
    """The map p -> (p - centre) / scale.

    Attributes:
        centre: (3,) float64 [mesh units].
        scale: Positive [mesh units].
    """

    centre: np.ndarray
    scale: float

    @staticmethod
    def of_record(record: Mapping[str, Any]) -> Similarity:
        """From the `centre` and the `scale` that a model file holds.

        Raises:
            KeyError, TypeError, ValueError: they are missing, or no three numbers and a positive one.
        """
        centre, scale = np.array(record["centre"], np.float64), float(record["scale"])
        if centre.shape != (3,) or not (np.isfinite([*centre, scale]).all() and scale > 0):
            raise ValueError("a centre or a scale that is none")
        return Similarity(centre, scale)

    def apply(self, points: np.ndarray) -> np.ndarray:
        """Maps points (..., 3) in mesh units to normalised ones, float64."""
        return (np.asarray(points, np.float64) - self.centre) / self.scale

    def inverse(self, points: np.ndarray) -> np.ndarray:
        """Maps normalised points (..., 3) back to mesh units, float64."""
        return np.asarray(points, np.float64) * self.scale + self.centre


def _are_similar(before: np.ndarray, after: np.ndarray) -> bool:
    """Whether vertices (V, 3) were shifted and scaled, and nothing else."""
    with np.errstate(invalid="ignore", over="ignore"):
        a, b = (points - points.mean(axis=0, dtype=np.float64) for points in (before, after))
        scale = np.linalg.norm(b) / max(float(np.linalg.norm(a)), 1e-300)
        return bool(np.abs(b - scale * a).max(initial=0.0) <= SIMILAR * np.abs(b).max(initial=0.0))


def _problems(mesh: Mesh) -> Iterator[tuple[str, str]]:
    """What is wrong with the arrays of a mesh, and what to do."""
    vertices, faces, uv = mesh.vertices, mesh.faces, mesh.uv
    if vertices.ndim != 2 or vertices.shape[1] != 3:
        yield f"vertices have shape {vertices.shape}", "give (V, 3) positions"
    if faces.ndim != 2 or faces.shape[1] != 3:
        yield f"faces have shape {faces.shape}", "give (F, 3) indices; triangulate polygons first"
    if not np.issubdtype(faces.dtype, np.integer):
        yield f"faces are {faces.dtype}", "give integer indices"
    if uv is not None and uv.shape != (*faces.shape, 2):
        yield f"uv has shape {uv.shape}", f"give one pair per face corner, {(*faces.shape, 2)}"
    if faces.size and faces.min() < 0:
        yield f"a face has the negative vertex index {faces.min()}", "re-export the mesh"
    if faces.size and faces.max() >= len(vertices):
        yield (
            f"a face refers to vertex {faces.max()}, but there are only {len(vertices)}",
            "the file is damaged or truncated; re-export it",
        )
    bad = ~np.isfinite(vertices).all(axis=1)
    if bad.any():
        first = int(np.flatnonzero(bad)[0])
        yield (
            f"{bad.sum()} of {len(vertices)} positions are NaN or infinite (first: vertex {first})",
            "repair the mesh and re-export it",
        )
    if uv is not None and not np.isfinite(uv).all():
        yield "some texture coordinates are NaN or infinite", "unwrap the mesh again or leave the uv out"
    yield from _normal_problems(faces, mesh.corner_normals)
    if mesh.polygons is not None and not _are_of(mesh.polygons, faces):
        yield "the polygons are not those of the faces", "leave them out where faces change"


def _are_of(polygons: Polygons, faces: np.ndarray) -> bool:
    if polygons.triangles.shape != faces.shape or not polygons.agreeing(faces[..., None]).all():
        return False
    if polygons.vertices is None:
        return True
    count = int(faces.max(initial=0)) + 1
    pairs = np.unique(polygons.vertices * count + polygons.at_corners(faces))
    return bool((np.diff(pairs // count) > 0).all())  # each vertex of the file is at one of the mesh


def _normal_problems(faces: np.ndarray, normals: np.ndarray | None) -> Iterator[tuple[str, str]]:
    if normals is None:
        return
    if normals.shape != (*faces.shape, 3):
        yield f"corner_normals have shape {normals.shape}", f"give one per face corner, {(*faces.shape, 3)}"
    if not (np.abs(np.linalg.norm(normals, axis=2) - 1.0) <= UNIT).all():
        yield "some corner_normals are not of length 1", "divide them by their length, or leave them out"
