"""A flat triangular lattice that repeats in x and y: a square whose opposite sides are joined."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np

from mitex.errors import MeshError
from mitex.mesh.mesh import Mesh

MARGIN = 2  # rows and columns of copies around the square: all neighbours of the corners of its faces
LEAST = 4  # fewer columns, and a vertex would be its own neighbour's neighbour


@dataclass(frozen=True, eq=False)
class Lattice:
    """Rows of nearly equilateral triangles on the square [0, columns]^2 of the plane z = 0, facing +z.

    Edges along the rows have length 1, and every other row is shifted by half an edge. The mesh goes on
    beyond the square by some rows and columns of copies, so that whatever is computed of a mesh needs to know
    nothing of periods: values are spread with `source`, and read at the points that `locate` finds.

    Attributes:
        mesh: its first `count` vertices are those of the square, the others copies of them.
        source: (V,) int64, of which of the first `count` vertices each one is a copy.
        columns, rows: of vertices in the square; `rows` is even. The lattice repeats after a length of
            `columns`, in both directions.
    """

    mesh: Mesh
    source: np.ndarray
    columns: int
    rows: int

    @staticmethod
    def of(columns: int) -> Lattice:
        """A lattice with `columns` vertices along a side.

        Raises:
            MeshError: fewer than four columns.
        """
        if columns < LEAST:
            raise MeshError(f"a lattice of {columns} columns is not possible", f"use {LEAST} or more")
        rows = 2 * round(columns / np.sqrt(3.0))
        width, height = columns + 2 * MARGIN, rows + 2 * MARGIN
        i, j = np.divmod(np.arange(height * width), width)
        i, j = i - MARGIN, j - MARGIN
        outside = (i < 0) | (i >= rows) | (j < 0) | (j >= columns)
        order = np.argsort(outside, kind="stable")
        number = np.empty_like(order)
        number[order] = np.arange(len(order))
        x, y = j + 0.5 * (i % 2), i * (columns / rows)
        points = np.stack([x, y, np.zeros_like(x)], axis=1)[order]
        source = ((i % rows) * columns + j % columns)[order]
        mesh = Mesh(points, number[_faces(height, width)], name="lattice")
        return Lattice(mesh, source, columns, rows)

    @property
    def count(self) -> int:
        """Number of vertices in the square."""
        return self.rows * self.columns

    @cached_property
    def joined(self) -> Mesh:
        """The square alone with its sides joined, a torus; the faces across them are long."""
        row, column = np.divmod(np.arange(self.count), self.columns)
        first = 2 * ((row + MARGIN) * (self.columns + 2 * MARGIN - 1) + column + MARGIN)
        faces = self.mesh.faces[np.concatenate([first, first + 1])]
        return Mesh(self.mesh.vertices[: self.count], self.source[faces], name="tile")

    @property
    def edge(self) -> float:
        """Mean length of the six edges at a vertex."""
        return (1 + 2 * float(np.hypot(0.5, self.columns / self.rows))) / 3

    def locate(self, points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """Where points of the plane lie on the mesh; those that are whole periods apart lie at one place.

        Args:
            points: (P, 2), x and y in periods.

        Returns:
            (P,) int32 faces and (P, 3) float32 barycentric coordinates.
        """
        x, y = (points - np.floor(points)).T
        row = np.minimum((y * self.rows).astype(np.int64), self.rows - 1)
        up = y * self.rows - row
        odd = row % 2 == 1
        # Sheared by half an edge, the triangles between two rows are halves of squares.
        across = x * self.columns - 0.5 * np.where(odd, 1 - up, up)
        column = np.floor(across).astype(np.int64)
        across = across - column
        second = np.where(odd, across < up, across + up > 1)
        face = 2 * ((row + MARGIN) * (self.columns + 2 * MARGIN - 1) + column + MARGIN) + second
        weights = np.select(
            [(odd & second)[:, None], odd[:, None], second[:, None]],
            [
                np.stack([1 - up, across, up - across], axis=1),
                np.stack([1 - across, across - up, up], axis=1),
                np.stack([1 - up, across + up - 1, 1 - across], axis=1),
            ],
            np.stack([1 - across - up, across, up], axis=1),
        )
        return face.astype(np.int32), weights.astype(np.float32)


def _faces(height: int, width: int) -> np.ndarray:
    """(F, 3) faces of `height` rows of `width` vertices, two for each square; odd rows are shifted right."""
    i, j = np.divmod(np.arange((height - 1) * (width - 1)), width - 1)
    a = i * width + j
    b, c, d = a + 1, a + width + 1, a + width
    odd = (i % 2 == 1)[:, None]
    first = np.where(odd, np.stack([a, b, c], axis=1), np.stack([a, b, d], axis=1))
    second = np.where(odd, np.stack([a, c, d], axis=1), np.stack([b, c, d], axis=1))
    return np.stack([first, second], axis=1).reshape(-1, 3)
