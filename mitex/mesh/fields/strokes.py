"""A smooth field that follows a few drawn strokes, and is as parallel as possible between them.

"Design of tangent vector fields" (Fisher, Schroder, Desbrun and Hoppe 2007) with the connection Laplacian:
the field u minimises sum_ij w_ij |u_i - r_ij u_j|^2, where r_ij carries a vector from vertex j to i and w_ij
are the cotangent weights. At the vertices nearest to a stroke it is the stroke's direction, of length 1, and
nowhere is it longer. On a plane each component is the harmonic interpolant. It slows down to zero where
strokes contradict each other, and where the surface leaves no choice: on a sphere every field is zero
somewhere.
"""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np

from mitex.errors import ConfigError
from mitex.geometry.vectors import across, dot, unit
from mitex.mesh.connection import connection_laplacian, solve, tangent_axes, transport
from mitex.mesh.cotangents import cotangent_weights
from mitex.mesh.mesh import Mesh
from mitex.progress import announce

NEAR = 0.1  # how far off the surface a stroke may be, relative to the diagonal of the mesh's box
FAINT = 1e-3  # of the strokes' directions at a vertex: less than that along the surface is none
WEIGHTS = 1e-6, 1e4  # of edges: positive for the solver, and no slivers beyond its digits


def read_strokes(place: Path) -> list[np.ndarray]:
    """The strokes in a JSON file {"strokes": [[[x, y, z], ...], ...]}: an (N, 3) float64 array each.

    Raises:
        ConfigError: something else is in the file.
        OSError: it cannot be read.
    """
    form = 'write {"strokes": [[[x, y, z], ...], ...]}'
    try:
        strokes = json.loads(place.read_text("utf-8"))["strokes"]
        return [np.array(stroke, np.float64).reshape(len(stroke), 3) for stroke in strokes]
    except (ValueError, KeyError, TypeError, OverflowError, RecursionError) as e:
        raise ConfigError(f"'{place}' holds no strokes", form) from e


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
    directions = across(_directions(mesh, tree, strokes), normals)
    fixed = np.linalg.norm(directions, axis=1) > FAINT
    if not fixed.any():
        raise ConfigError(
            f"the strokes have no direction along the surface of '{mesh.name}'", "draw them on the surface"
        )
    x, y = tangent_axes(normals)
    directions = unit(directions)
    u = np.where(fixed, dot(directions, x) + 1j * dot(directions, y), 0.0)
    announce("spreading the strokes over the mesh")
    pairs, weights = cotangent_weights(mesh)
    carried = transport(normals, x, y, pairs)
    u = _spread(connection_laplacian(pairs, carried, np.clip(weights, *WEIGHTS), len(u)), fixed, u)
    return np.real(u)[:, None] * x + np.imag(u)[:, None] * y


def _spread(laplacian: Any, fixed: np.ndarray, u: np.ndarray) -> np.ndarray:
    """(V,) complex: u where it is fixed, L u = 0 elsewhere, zero where nothing fixed is connected."""
    from scipy.sparse.csgraph import connected_components

    count, component = connected_components(abs(laplacian), directed=False)
    free = ~fixed & (np.bincount(component, fixed, count) > 0)[component]
    if free.any():
        rows = laplacian.tocsr()[free]
        u = u.copy()
        u[free] = solve(rows[:, free].tocsc(), -rows[:, fixed] @ u[fixed])
    return u


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


def _directions(mesh: Mesh, tree: Any, strokes: Sequence[np.ndarray]) -> np.ndarray:
    """(V, 3) mean unit vectors along the strokes at the vertices nearest to them, zero elsewhere."""
    spacing = 0.5 * float(mesh.edge_lengths.mean())
    total, passes = np.zeros(mesh.vertices.shape), np.zeros((len(mesh.vertices), 1))
    for stroke in strokes:
        for start, step in zip(stroke[:-1], np.diff(stroke, axis=0), strict=True):
            samples = 1 + int(np.linalg.norm(step) / spacing)
            along = (np.arange(samples) + 0.5) / samples
            nearest = tree.query(start + along[:, None] * step)[1]
            np.add.at(total, nearest, unit(step))
            np.add.at(passes, nearest, float(step.any()))
    return total / np.maximum(passes, 1)
