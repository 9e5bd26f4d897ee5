"""What is going to be covered with patches: its texels, and which of them a patch covers around each."""

from __future__ import annotations

from typing import Protocol

import numpy as np

from mitex.mesh import Mesh
from mitex.mesh.frames import vertex_directions
from mitex.mesh.split import split_with_values
from mitex.quilting.flattening import Flattening
from mitex.quilting.texels import FaceTexels

FINE = 8  # faces along the side of a patch, at least
EVEN = 20  # and along the mesh
REACH = 0.85  # from the middle of a patch to its corners, and some room for ways along edges [sides]


class Target(Protocol):
    """N texels for `quilt_on`."""

    @property
    def count(self) -> int:
        """N."""
        ...

    @property
    def area(self) -> float:
        """Of a texel, in the mean [texels of a patch]."""
        ...

    @property
    def sizes(self) -> np.ndarray | None:
        """(N,) factors of the size of the patches whose middles lie on the texels; None where all are 1."""
        ...

    def around(self, texel: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """The texels that a patch covers whose middle lies on one of them.

        Returns:
            (M,) texels, `texel` among them; (M, 2) float column and row in the patch, in [-0.5, patch - 0.5);
            and (M,) the angle from where the texture's right shall point there to the patch's right,
            counter-clockwise seen from outside [rad].
        """
        ...

    def in_order(self) -> np.ndarray:
        """(N,) the texels, as they are going to be covered where nothing is yet."""
        ...

    def map(self, values: np.ndarray) -> np.ndarray:
        """(side, side, ...) with the values (N, ...) at the texels, and zeros elsewhere."""
        ...


def mean_area(mesh: Mesh, gap: float, count: int) -> float:
    """Of a texel [texels of a patch], where `count` share a mesh and those of a patch are `gap` apart."""
    return float(mesh.face_areas.sum()) / (gap**2 * max(count, 1))


class SurfaceTarget:
    """A mesh as a `Target`.

    Attributes:
        mesh: fine enough to be laid flat, on the surface of the given one.
        directions: (V, 3) where the texture's right points at its vertices.
        texels: of the map.
        flattening: lays the surroundings of a point flat.
        patch, gap: as given.
        sizes: (N,) factors of the gap at the texels; None where all are 1.

    Args:
        mesh: V vertices, with a layout in [0, 1] in which nothing overlaps.
        side: of the map on the layout [texels].
        patch: side of a patch [texels].
        gap: between texels of a patch, on the surface [mesh units].
        directions: (V, 3) where the texture's right shall point; None for `vertex_directions`.
        sizes: (side, side) factors of the gap.
    """

    def __init__(
        self,
        mesh: Mesh,
        side: int,
        patch: int,
        gap: float,
        directions: np.ndarray | None = None,
        sizes: np.ndarray | None = None,
    ) -> None:
        assert mesh.uv is not None
        extent = float(np.ptp(mesh.vertices, axis=0).max())
        least = gap if sizes is None else gap * float(sizes.min())
        length = min(patch * least / FINE, extent / EVEN)
        given = np.zeros((len(mesh.vertices), 0)) if directions is None else directions
        self.mesh, given = split_with_values(mesh, length, given)
        self.directions = vertex_directions(self.mesh) if directions is None else given
        self.texels = FaceTexels.rasterize(np.asarray(self.mesh.uv), side)
        self.flattening = Flattening(self.mesh, self.directions, REACH * patch * gap)
        self.patch, self.gap = patch, gap
        self.sizes = None if sizes is None else sizes.ravel()[self.texels.index]

    @property
    def count(self) -> int:
        """N."""
        return len(self.texels.index)

    @property
    def area(self) -> float:
        """See `Target`."""
        return mean_area(self.mesh, self.gap, self.count)

    def around(self, texel: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See `Target`."""
        texels, half = self.texels, 0.5 * self.patch
        size = 1.0 if self.sizes is None else float(self.sizes[texel])
        faces, corners = self.flattening(int(texels.face[texel]), texels.barycentric[texel], size)
        index, row, place = texels.of(faces, corners * np.array([1.0, -1.0]) / (size * self.gap))
        inside = (np.abs(place + np.finfo(np.float32).eps) < half).all(1)
        angle = self.flattening.turns(faces, corners)[row]
        return index[inside], place[inside] + (half - 0.5), angle[inside]

    def in_order(self) -> np.ndarray:
        """(N,) the texels, those that are near to where their part of the mesh begins first."""
        return np.argsort(self.flattening.distances()[self.texels.face], kind="stable")

    def map(self, values: np.ndarray) -> np.ndarray:
        """(side, side, ...) with the values (N, ...) at the texels, and zeros between charts."""
        side = self.texels.side
        image = np.zeros((side * side, *values.shape[1:]), values.dtype)
        image[self.texels.index] = values
        return image.reshape(side, side, *values.shape[1:])


class TileTarget:
    """A square whose opposite sides are joined, as a `Target`.

    Attributes:
        area, sizes: its texels are those of a patch.

    Args:
        side: of the square, at least the patch's [texels].
        patch: side of a patch [texels].
    """

    area = 1.0
    sizes = None

    def __init__(self, side: int, patch: int) -> None:
        self.side, self.patch = side, patch

    @property
    def count(self) -> int:
        """N = side x side, row by row."""
        return self.side**2

    def around(self, texel: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """See `Target`."""
        row, column = np.divmod(np.arange(self.patch**2), self.patch)
        middle_row, middle_column = divmod(texel, self.side)
        rows = (middle_row - self.patch // 2 + row) % self.side
        columns = (middle_column - self.patch // 2 + column) % self.side
        place = np.stack([column, row], axis=1).astype(np.float64)
        return rows * self.side + columns, place, np.zeros(len(place))

    def in_order(self) -> np.ndarray:
        """(N,) the texels, row by row."""
        return np.arange(self.count)

    def map(self, values: np.ndarray) -> np.ndarray:
        """See `Target`."""
        return values.reshape(self.side, self.side, *values.shape[1:])
