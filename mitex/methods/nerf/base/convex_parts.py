"""Convex parts of a shape, and their union as one closed mesh."""

from __future__ import annotations

import numpy as np
from scipy.spatial import ConvexHull, QhullError

from mitex.errors import MeshError
from mitex.mesh import Mesh
from mitex.methods.nerf.base.isosurface import isosurface, without_cavities
from mitex.optional import optional

MARGIN = 3  # cells around the union
GROWN = 0.25  # cells by which parts grow, so that those that only touch become one
SAME_PLANE = 6  # decimals in which the planes of a hull's faces must differ


def convex_parts(mesh: Mesh, concavity: float) -> list[np.ndarray]:
    """The corners (V, 3) of convex parts that cover the mesh approximately (CoACD, Wei et al. 2022).

    Args:
        mesh: closed; the time grows with its faces: some 10 s for 5,000.
        concavity: how far the parts may be from the shape, in (0, 1]; 1 gives one or a few.

    Raises:
        MeshError: CoACD finds nothing.
        MissingPackage: CoACD is not installed.
    """
    coacd = optional("coacd", "nerf")
    coacd.set_log_level("error")
    dense = coacd.Mesh(mesh.vertices.astype(np.float64), mesh.faces)
    # A search a third as long as CoACD's default; the number of parts is about the same.
    parts = coacd.run_coacd(
        dense, threshold=concavity, pca=True, mcts_iterations=60, mcts_nodes=10, resolution=1000
    )
    parts = [corners for corners, _ in parts]
    if not parts:
        raise MeshError(f"{mesh.name} has no convex parts", "give a base mesh as `base_mesh`")
    return parts


def union(parts: list[np.ndarray], cell: float) -> Mesh:
    """One closed manifold mesh around convex parts, without the parts of their faces that lie inside.

    A hull is the set where the depth below every plane of its faces is positive; the largest of the parts'
    depths on a grid is positive in their union.

    Args:
        parts: corners (V, 3) of each; flat ones are left out.
        cell: of the grid, the size of the mesh's triangles.

    Raises:
        MeshError: all parts are flat.
    """
    hulls = [hull for corners in parts if (hull := _hull(corners)) is not None]
    if not hulls:
        raise MeshError("the base shape has no volume", "give a base mesh as `base_mesh`")
    low = np.min([hull.min_bound for hull in hulls], axis=0) - MARGIN * cell
    high = np.max([hull.max_bound for hull in hulls], axis=0) + MARGIN * cell
    depth = np.full(np.ceil((high - low) / cell).astype(int) + 1, -cell, np.float32)
    for hull in hulls:
        first = np.floor((hull.min_bound - low) / cell).astype(int) - 1
        last = np.ceil((hull.max_bound - low) / cell).astype(int) + 1
        block = depth[tuple(slice(a, b + 1) for a, b in zip(first, last, strict=True))]
        depths = _depth(hull, low + cell * first, cell, block.shape) + np.float32(GROWN * cell)
        np.maximum(block, depths, out=block)
    return isosurface(without_cavities(depth, 0.0), 0.0, low=low, cell=cell)


def _hull(corners: np.ndarray) -> ConvexHull | None:
    try:
        return ConvexHull(corners)
    except QhullError:
        return None


def _depth(hull: ConvexHull, low: np.ndarray, cell: float, shape: tuple[int, ...]) -> np.ndarray:
    """Depths on a grid below the nearest plane of the hull's faces, negative outside."""
    planes = np.unique(hull.equations.round(SAME_PLANE), axis=0)
    x, y, z = (a + cell * np.arange(n) for a, n in zip(low, shape, strict=True))
    across = y[:, None, None] * planes[:, 1] + z[:, None] * planes[:, 2] + planes[:, 3]
    across = across.astype(np.float32)
    along = (x[:, None] * planes[:, 0]).astype(np.float32)
    return np.stack([-(across + slab).max(axis=-1) for slab in along])
