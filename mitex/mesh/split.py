"""Long edges split in the middle, as often as it takes: a mesh without large faces, on the same surface."""

from __future__ import annotations

import numpy as np

from mitex.errors import MeshError
from mitex.mesh.mesh import Mesh
from mitex.mesh.subdivide import MAX_FACES
from mitex.mesh.topology import face_edges

# Children of a face by the sides that are split: bit k is the side from corner k to the next. Numbers 0 to 2
# are its corners, 3 to 5 the middles of its sides.
CHILDREN = (
    ((0, 1, 2),),
    ((0, 3, 2), (3, 1, 2)),
    ((0, 1, 4), (0, 4, 2)),
    ((3, 1, 4), (0, 3, 4), (0, 4, 2)),
    ((0, 1, 5), (5, 1, 2)),
    ((0, 3, 5), (3, 1, 5), (5, 1, 2)),
    ((5, 4, 2), (0, 1, 4), (0, 4, 5)),
    ((0, 3, 5), (3, 1, 4), (5, 4, 2), (3, 4, 5)),
)


def split_with_values(mesh: Mesh, length: float, values: np.ndarray) -> tuple[Mesh, np.ndarray]:
    """The same surface with no edge longer than `length`, and values of its vertices.

    Faces on both sides of an edge are split alike, so there are no gaps; corner UVs and values are halved
    linearly.

    Args:
        mesh: V vertices.
        length: positive [mesh units].
        values: (V, K).

    Returns:
        The mesh of V' vertices, and (V', K) float64.

    Raises:
        MeshError: the result would have more than 32 million faces.
    """
    vertices, faces = np.concatenate([mesh.vertices, values], axis=1, dtype=np.float64), mesh.faces
    uv = mesh.uv
    while True:
        pairs, sides = face_edges(faces, len(vertices))
        ends = vertices[pairs]
        long = np.linalg.norm(ends[:, 1, :3] - ends[:, 0, :3], axis=1) > length
        if not long.any():
            return Mesh(vertices[:, :3], faces, uv, mesh.name), vertices[:, 3:]
        middle = len(vertices) + np.cumsum(long) - 1
        kinds = long[sides] @ (1, 2, 4)
        parents, places = _children(kinds)
        if len(parents) > MAX_FACES:
            problem = f"{mesh.name} with edges of {length:.3g} at most would have {len(parents):,} faces"
            raise MeshError(problem, "use longer ones")
        vertices = np.concatenate([vertices, ends[long].mean(axis=1)])
        faces = _picked(np.concatenate([faces, middle[sides]], axis=1), parents, places)
        if uv is not None:
            halved = np.concatenate([uv, 0.5 * (uv + np.roll(uv, -1, axis=1))], axis=1)
            uv = _picked(halved, parents, places)


def _children(kinds: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """(N,) parents of the new faces and (N, 3) their corners, as in `CHILDREN`, from kinds (F,)."""
    parents, places = [], []
    for kind, children in enumerate(CHILDREN):
        faces = np.flatnonzero(kinds == kind)
        parents.append(np.repeat(faces, len(children)))
        places.append(np.tile(np.array(children), (len(faces), 1)))
    return np.concatenate(parents), np.concatenate(places)


def _picked(values: np.ndarray, parents: np.ndarray, places: np.ndarray) -> np.ndarray:
    """(N, 3, ...) of the values (F, 6, ...) of corners and middles."""
    return values[parents[:, None], places]
