"""Quilting from vertices to vertices: patches of what those of one mesh have, and another mesh's to cover."""

from __future__ import annotations

import numpy as np
from scipy.interpolate import LinearNDInterpolator

from mitex.mesh import Mesh
from mitex.mesh.frames import vertex_directions
from mitex.quilting.flattening import Flattening
from mitex.quilting.matching import ArraySource
from mitex.quilting.target import REACH, mean_area

FEWEST = 3  # points of a triangle
BEYOND = 2  # how much farther to look, so that vertices lie around all of a patch [mean edges]


class VertexTarget:
    """The vertices of a mesh as a `Target`; those without faces stay as they are.

    Attributes:
        sizes: patches have one size.

    Args:
        mesh: V vertices, with edges that are short beside a patch.
        patch: side of a patch [texels].
        gap: between texels of a patch, on the surface [mesh units].
        directions: (V, 3) where a patch's right shall point; None for `vertex_directions`.
    """

    sizes = None

    def __init__(self, mesh: Mesh, patch: int, gap: float, directions: np.ndarray | None = None) -> None:
        self.mesh, self.patch, self.gap = mesh, patch, gap
        reach = REACH * patch * gap + BEYOND * float(mesh.edge_lengths.mean())
        right = vertex_directions(mesh) if directions is None else directions
        self.flattening = Flattening(mesh, right, reach)
        self.vertices, corner = np.unique(mesh.faces, return_index=True)
        self.face, self.corner = np.divmod(corner, 3)
        self.number = np.full(len(mesh.vertices), -1)
        self.number[self.vertices] = np.arange(len(self.vertices))

    @property
    def count(self) -> int:
        """N, how many vertices have faces."""
        return len(self.vertices)

    @property
    def area(self) -> float:
        """See `Target`."""
        return mean_area(self.mesh, self.gap, self.count)

    def flat(self, vertex: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The surroundings of one of the N in the plane, somewhat farther than a patch reaches.

        Returns:
            (M,) of the N, (M, 2) columns and rows from it [texels], and (M,) angles as of `Target.around`.
        """
        weights = np.eye(3)[self.corner[vertex]]
        faces, corners = self.flattening(int(self.face[vertex]), weights)
        around, first = np.unique(self.mesh.faces[faces], return_index=True)
        place = corners.reshape(-1, 2)[first] * np.array([1.0, -1.0]) / self.gap
        return self.number[around], place, self.flattening.turns(faces, corners)[first // 3]

    def around(self, texel: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See `Target`."""
        vertices, place, angle = self.flat(texel)
        half = 0.5 * self.patch
        inside = (np.abs(place + np.finfo(np.float32).eps) < half).all(1)
        return vertices[inside], place[inside] + (half - 0.5), angle[inside]

    def in_order(self) -> np.ndarray:
        """(N,) those first that are near to where their part of the mesh begins."""
        return np.argsort(self.flattening.distances()[self.face], kind="stable")

    def map(self, values: np.ndarray) -> np.ndarray:
        """(V, ...) with the values (N, ...), and zeros where there are no faces."""
        whole = np.zeros((len(self.mesh.vertices), *values.shape[1:]), values.dtype)
        whole[self.vertices] = values
        return whole


def vertex_patches(
    mesh: Mesh,
    values: np.ndarray,
    size: int,
    gap: float,
    places: int,
    turns: int,
    rng: np.random.Generator,
    directions: np.ndarray | None = None,
) -> ArraySource:
    """Patches of what vertices have, around some of them, in several directions.

    Args:
        mesh: V vertices.
        values: (V, C).
        size: side of a patch [texels].
        gap: between texels [mesh units].
        places: vertices to take patches around, at most.
        turns: patches around each, turned by equal angles, from `directions` on.
        rng: of places and, without directions, of the first angles.
        directions: (V, 3) where a patch's right shall point; None for anywhere.

    Returns:
        The patches that lie on the mesh entirely, possibly none; their centres are in texels.
    """
    target = VertexTarget(mesh, size, gap, directions)
    middle = np.arange(size) - 0.5 * (size - 1)
    grid = np.stack(np.meshgrid(middle, middle), axis=2)
    squares, centres = [np.zeros((0, size, size, values.shape[1]), np.float32)], [np.zeros((0, 3))]
    for vertex in rng.permutation(target.count)[:places]:
        vertices, place, _ = target.flat(int(vertex))
        if len(vertices) <= FEWEST:
            continue
        first = rng.uniform(0, 2 * np.pi) if directions is None else 0.0
        angles = first + 2 * np.pi * np.arange(turns) / turns
        cos, sin = np.cos(angles), np.sin(angles)
        turned = grid @ np.array([[cos, sin], [-sin, cos]]).transpose(2, 0, 1)[:, None]
        around = LinearNDInterpolator(place, values[target.vertices[vertices]])(turned)
        whole = around[np.isfinite(around).all((1, 2, 3))]
        squares.append(whole.astype(np.float32))
        centres.append(np.tile(mesh.vertices[target.vertices[vertex]] / gap, (len(whole), 1)))
    return ArraySource(np.concatenate(squares), np.concatenate(centres), float(size))
