"""Whether a texture knows where the charts of a layout end."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np

from mitex.asset import Asset
from mitex.geometry.triangles import interpolate
from mitex.images import bilinear
from mitex.mesh import Mesh
from mitex.mesh.topology import paired_sides

POINTS = 20_000  # on each kind of edge, at most


Values = Callable[[np.ndarray, np.ndarray], np.ndarray]  # faces (P,), barycentrics (P, 3) -> (P, C)


def seam_ratio(asset: Asset, step: float) -> float:
    """How much more an asset's colours change across the seams of its layout than across other edges.

    Args:
        asset: with an albedo texture.
        step: as of `ratio_across`.

    Returns:
        As `ratio_across`, of the albedo in sRGB; NaN without textures.
    """
    if asset.atlas is None or asset.texture_maps is None or "albedo" not in asset.texture_maps:
        return math.nan
    albedo, uv = asset.texture_maps["albedo"], asset.atlas.uv

    def colours(face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        return bilinear(albedo, interpolate(barycentric, uv[face]))

    return ratio_across(asset.mesh, uv, colours, step)


def ratio_across(mesh: Mesh, uv: np.ndarray, values: Values, step: float, seed: int = 0) -> float:
    """How much more values on a surface change across the seams of a layout than across other edges.

    Random points on edges between two faces; the mean absolute difference of the values half a step to both
    sides, on edges where the UVs are cut over that on others.

    Args:
        mesh: F faces.
        uv: (F, 3, 2) the layout.
        values: at points of the surface.
        step: between the two sides [mesh units], about a texel.
        seed: of the points.

    Returns:
        1 where seams cannot be seen, more where they can; NaN without seams, or if nothing changes.
    """
    sides = paired_sides(mesh.faces, len(mesh.vertices))
    cut = _is_cut(uv, mesh.faces, sides)
    generator = np.random.default_rng(seed)
    across, within = (_change(mesh, values, sides[kind], step, generator) for kind in (cut, ~cut))
    return across / within if within > 0 else math.nan


def _is_cut(uv: np.ndarray, faces: np.ndarray, sides: np.ndarray) -> np.ndarray:
    """(E,) bool: whether the two faces have different UVs at a corner that they share."""
    ends = [_ends(side, faces, uv) for side in sides.T]
    same = np.abs(ends[0] - ends[1]).max((1, 2)) < 1e-6
    return ~same


def _ends(side: np.ndarray, faces: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """(E, 2, 2) UVs at both ends of sides, that of the vertex with the lower number first."""
    face, corner = np.divmod(side, 3)
    corners = np.stack([corner, (corner + 1) % 3], axis=1)
    order = np.argsort(faces[face[:, None], corners], axis=1)
    return uv[face[:, None], np.take_along_axis(corners, order, 1)]


def _change(
    mesh: Mesh, values: Values, sides: np.ndarray, step: float, generator: np.random.Generator
) -> float:
    """Mean absolute difference across edges, whose points are drawn by length; NaN without edges."""
    if not len(sides):
        return math.nan
    faces, points = mesh.faces, mesh.vertices.astype(np.float64)
    face, corner = np.divmod(sides, 3)
    start, end = (points[faces[face[:, 0], (corner[:, 0] + k) % 3]] for k in (0, 1))
    length = np.linalg.norm(end - start, axis=1)
    edge = generator.choice(len(sides), min(POINTS, 20 * len(sides)), p=length / length.sum())
    along = generator.uniform(0, 1, len(edge))
    # The two faces run along their edge in opposite directions.
    beside = [
        values(*_beside(mesh, sides[edge, k], length[edge], along if k == 0 else 1 - along, 0.5 * step))
        for k in (0, 1)
    ]
    return float(np.abs(beside[0] - beside[1]).mean())


def _beside(
    mesh: Mesh, side: np.ndarray, length: np.ndarray, along: np.ndarray, step: float
) -> tuple[np.ndarray, np.ndarray]:
    """Faces and barycentrics inwards of edges, a step away or at the opposite corner if that is nearer."""
    face, corner = np.divmod(side, 3)
    height = 2 * mesh.face_areas[face] / np.maximum(length, 1e-30)
    inwards = np.minimum(step / np.maximum(height, 1e-30), 1.0)
    rows = np.arange(len(face))
    barycentric = np.zeros((len(face), 3))
    barycentric[rows, corner] = (1 - inwards) * (1 - along)
    barycentric[rows, (corner + 1) % 3] = (1 - inwards) * along
    barycentric[rows, (corner + 2) % 3] = inwards
    return face, barycentric
