"""Borders of open meshes, which a relief leaves where they are: displaced, they would look torn."""

from __future__ import annotations

import numpy as np

from mitex.mesh import Mesh
from mitex.mesh.nearest import distances
from mitex.mesh.topology import boundary_edges

REACH = 1.5  # within which a relief rises from a border to its full height [mean edges of the first level]
DETOUR = 2.0  # how much longer ways along edges may be than straight ones


def with_borders(before: Mesh, after: Mesh, reach: float) -> Mesh:
    """A displaced mesh whose borders have not moved, and less so what is near to them along the surface.

    Args:
        before: the mesh without the displacement, with the faces of `after`.
        after: the displaced mesh.
        reach: distance from a border up to which the displacement is less than whole [mesh units].
    """
    border = np.unique(boundary_edges(before.faces, len(before.vertices)))
    if not len(border):
        return after
    distance = distances(before, border, DETOUR * reach)
    t = np.minimum(distance / reach, 1.0)[:, None]
    share = t * t * (3 - 2 * t)
    return after.with_vertices(before.vertices + share * (after.vertices - before.vertices))
