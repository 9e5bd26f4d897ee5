"""A smooth field that follows a few drawn strokes, and is as parallel as possible between them.

"Design of tangent vector fields" (Fisher, Schroder, Desbrun and Hoppe 2007) with the connection Laplacian:
for each stroke k, u_k minimises sum_ij w_ij |u_i - r_ij u_j|^2, where r_ij carries a vector from vertex j
to i and w_ij are the cotangent weights. At the vertices nearest to the stroke it is the stroke's direction,
and at those nearest to other strokes zero. On a curved surface vectors fade with the distance, since what
is parallel depends on the way there. So the field is

    u = sum_k u_k / sum_k |u_k|,

of length 1 where strokes agree and where there is only one, and slower between strokes that contradict each
other. On a plane, for straight strokes, its components are the harmonic interpolants.
"""

from __future__ import annotations

import json
from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.vectors import dot, unit
from mitex.mesh.connection import connection_laplacian, solver, tangent_axes, transport
from mitex.mesh.cotangents import cotangent_weights
from mitex.mesh.mesh import Mesh
from mitex.mesh.vertex_files import readable
from mitex.progress import announce
from mitex.reading import content

NEAR = 0.1  # how far off the surface a stroke may be, relative to the diagonal of the mesh's box
LARGEST = 64 << 20  # file of strokes [bytes]
FAINT = 1e-3  # of the strokes' directions at a vertex: less than that along the surface is none
LOST = 1e-12  # nothing of the strokes arrives where less than that does
WEIGHTS = 1e-6, 1e4  # of edges: positive for the solver, and no slivers beyond its digits


def read_strokes(place: Path) -> list[np.ndarray]:
    """The strokes in a JSON file {"strokes": [[[x, y, z], ...], ...]}: an (N, 3) float64 array each.

    Raises:
        ConfigError: there is no such file, it cannot be read, or something else is in it.
    """
    form = 'write {"strokes": [[[x, y, z], ...], ...]}'
    with readable(place, "strokes", "holds no strokes", form):
        strokes = json.loads(content(place, LARGEST))["strokes"]
        return [np.array(stroke, np.float64).reshape(len(stroke), 3) for stroke in strokes]


def stroke_vectors(mesh: Mesh, strokes: Sequence[np.ndarray]) -> np.ndarray:
    """The vectors at the vertices that follow the strokes.

    Args:
        mesh: V vertices.
        strokes: one or more polylines (N, 3) on or near the surface, in its units, drawn the way that it
            moves.

    Returns:
        (V, 3) float64, across `mesh.normals`, at most of length 1; zero on components without a stroke.

    Raises:
        ConfigError: no strokes; one that is not (N, 3) finite numbers, has no length, or is far from the
            surface; strokes across the surface everywhere.
    """
    from scipy.spatial import KDTree

    tree = KDTree(mesh.vertices)
    _check(mesh, tree, strokes)
    normals = unit(mesh.normals.astype(np.float64))
    x, y = tangent_axes(normals)
    directions = [_direction(mesh, tree, stroke) for stroke in strokes]
    drawn = [dot(direction, x) + 1j * dot(direction, y) for direction in directions]
    fixed = np.abs(drawn).sum(axis=0) > FAINT
    if not fixed.any():
        raise ConfigError(
            f"the strokes have no direction along the surface of '{mesh.name}'", "draw them on the surface"
        )
    announce("spreading the strokes over the mesh")
    pairs, weights = cotangent_weights(mesh)
    carried = transport(normals, x, y, pairs)
    laplacian = connection_laplacian(pairs, carried, np.clip(weights, *WEIGHTS), len(normals))
    u, reach = np.zeros(len(normals), complex), np.zeros(len(normals))
    for part in _extended(laplacian, fixed, drawn):
        u += part
        reach += np.abs(part)
    u = np.where(reach > LOST, u / np.maximum(reach, LOST), 0.0)
    return np.real(u)[:, None] * x + np.imag(u)[:, None] * y


def _extended(laplacian: Any, fixed: np.ndarray, drawn: list[np.ndarray]) -> Iterator[np.ndarray]:
    """(V,) complex for each stroke: its values where any is fixed, L u = 0 elsewhere.

    Zero where nothing fixed is connected.
    """
    from scipy.sparse.csgraph import connected_components

    count, component = connected_components(abs(laplacian), directed=False)
    free = ~fixed & (np.bincount(component, fixed, count) > 0)[component]
    rows = laplacian.tocsr()[free]
    solve = solver(rows[:, free].tocsc()) if free.any() else None
    for values in drawn:
        u = np.where(fixed, values, 0.0)
        if solve is not None:
            u[free] = solve(-rows[:, fixed] @ u[fixed])
        yield u


def _check(mesh: Mesh, tree: Any, strokes: Sequence[np.ndarray]) -> None:
    if not len(strokes):
        raise ConfigError("there are no strokes", "draw at least one")
    size = float(np.linalg.norm(np.ptp(mesh.vertices, axis=0)))
    for number, stroke in enumerate(strokes, 1):
        if stroke.ndim != 2 or stroke.shape[1] != 3 or not np.isfinite(stroke).all():
            raise ConfigError(f"stroke {number} has points that are not three finite numbers", "draw it anew")
        if len(np.unique(stroke, axis=0)) < 2:
            raise ConfigError(f"stroke {number} has no length", "give it two points or more")
        distance = float(tree.query(stroke)[0].max())
        if distance > NEAR * size + mesh.edge_lengths.max():
            raise ConfigError(
                f"stroke {number} is {distance:.3g} away from the vertices of '{mesh.name}', whose size is "
                f"{size:.3g}",
                "draw it on the surface, in the mesh's own coordinates",
            )


def _direction(mesh: Mesh, tree: Any, stroke: np.ndarray) -> np.ndarray:
    """(V, 3) mean unit vectors along a stroke at the vertices nearest to it, zero elsewhere."""
    spacing = 0.5 * float(mesh.edge_lengths.mean())
    total, passes = np.zeros(mesh.vertices.shape), np.zeros((len(mesh.vertices), 1))
    for start, step in zip(stroke[:-1], np.diff(stroke, axis=0), strict=True):
        samples = 1 + int(np.linalg.norm(step) / spacing)
        along = (np.arange(samples) + 0.5) / samples
        nearest = tree.query(start + along[:, None] * step)[1]
        np.add.at(total, nearest, unit(step))
        np.add.at(passes, nearest, float(step.any()))
    return total / np.maximum(passes, 1)
