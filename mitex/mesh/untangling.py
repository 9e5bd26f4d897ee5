"""Drawing a displacement back where it makes the surface pierce itself."""

from __future__ import annotations

import logging
import warnings

import numpy as np

from mitex.errors import MeshWarning
from mitex.mesh import Mesh
from mitex.mesh.matrices import ring_means
from mitex.mesh.self_intersections import piercing_pairs
from mitex.progress import announce

ROUNDS = 24
RINGS = 2  # of vertices around piercing faces that are drawn back less and less
BACK = 0.25  # part of the displacement that a round takes away at a piercing face
ALLOWED = 2  # pairs that may stay for each one without the displacement

log = logging.getLogger(__name__)


def untangled(before: Mesh, after: Mesh) -> Mesh:
    """A displaced mesh that pierces itself at most twice as often as the mesh without the displacement.

    Each round takes a part of the displacement of piercing faces, and less of that of the vertices around.
    How many pairs of faces pierce each other before and after is logged; a `MeshWarning` says so if more are
    left.

    Args:
        before: the mesh without the displacement, with the faces of `after`.
        after: the displaced mesh.

    Returns:
        `after` with other vertices; what `ROUNDS` rounds leave, if that is more.
    """
    ring, move = ring_means(after), after.vertices.astype(np.float64) - before.vertices
    share, mesh = np.ones(len(move)), after
    own, pairs = len(piercing_pairs(before)), piercing_pairs(after)
    first = len(pairs)
    for k in range(ROUNDS):
        if len(pairs) <= ALLOWED * own:
            break
        announce("drawing back piercing faces", k, ROUNDS)
        weight = np.zeros(len(move))
        weight[after.faces[pairs]] = 1.0
        for _ in range(RINGS):
            weight = np.maximum(weight, ring @ weight)
        share *= 1 - BACK * weight
        mesh = after.with_vertices(before.vertices + share[:, None] * move)
        moved = np.flatnonzero(weight[after.faces].any(1))
        still = pairs[~np.isin(pairs, moved).any(1)]
        pairs = np.concatenate([still, piercing_pairs(mesh, moved)])
    log.info(
        "pairs of faces that pierce each other: %d, before %d, without the relief %d",
        len(pairs),
        first,
        own,
    )
    if len(pairs) > ALLOWED * own:
        warnings.warn(
            f"{len(pairs)} pairs of faces of {after.name} still pierce each other, {own} without the relief",
            MeshWarning,
            stacklevel=2,
        )
    return mesh
