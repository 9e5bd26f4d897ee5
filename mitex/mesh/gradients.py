"""Derivatives of vertex values on a mesh, as a sparse matrix."""

from __future__ import annotations

from typing import Any

import numpy as np

from mitex.mesh.mesh import Mesh


def values_and_gradients(mesh: Mesh) -> Any:
    """The (4 V, V) scipy CSR matrix that makes of values at the vertices values and gradients.

    Row 4 v is the value of vertex v, rows 4 v + 1 to 4 v + 3 its derivatives by x, y, z [1 / mesh unit]: the
    mean of the gradients of the linear interpolants on the faces around, weighted by their areas. On even
    meshes that is exact for quadratic polynomials. Faces without area do not count; a vertex without any
    other has gradient 0.
    """
    import scipy.sparse

    count = len(mesh.vertices)
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    crosses = mesh.face_crosses
    area2 = np.linalg.norm(crosses, axis=1)
    used = area2 > 1e-12 * max(float(area2.max(initial=0.0)), 1e-300)
    faces, corners, crosses, area2 = mesh.faces[used], corners[used], crosses[used], area2[used]
    # The gradient of corner k's hat function is (normal x opposite side) / (2 area).
    sides = np.roll(corners, 1, axis=1) - np.roll(corners, -1, axis=1)
    hats = np.cross((crosses / area2[:, None])[:, None], sides)  # times 2 area
    total = np.bincount(faces.ravel(), np.repeat(area2, 3), count)
    weighted = hats[:, None] / np.where(total > 0, total, 1.0)[faces][:, :, None, None]
    rows = 4 * faces[:, :, None, None] + np.arange(1, 4)
    rows = np.broadcast_to(rows, weighted.shape)
    columns = np.broadcast_to(faces[:, None, :, None], weighted.shape)
    own = np.arange(count)
    entries = np.concatenate([np.ones(count), weighted.ravel()])
    indices = np.concatenate([4 * own, rows.ravel()]), np.concatenate([own, columns.ravel()])
    return scipy.sparse.csr_array((entries, indices), shape=(4 * count, count))
