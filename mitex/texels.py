"""Texels on the surface: which of them a UV layout uses, and where each one lies (Kovacs et al. 2024, 3.1).

Feature maps live on the texels of a texture. A texel counts if any of its square overlaps a face, as bilinear
lookups at a chart's border read those too; the authors' code does the same, but leaves out the last row and
column and moves the border texels onto mesh vertices instead of the nearest point.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property

import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components
from scipy.spatial import KDTree

from mitex.errors import ConfigError, MeshError
from mitex.geometry.conservative import FLAT, cover, nearest_points
from mitex.geometry.raster import texel_space
from mitex.geometry.triangles import interpolate, twice_area
from mitex.mesh import Mesh
from mitex.mesh.topology import face_edges, welded
from mitex.ranges import TEXELS

CHUNK = 1 << 17  # points that are looked at together: a megabyte per array stays in the cache
NO_WEIGHT = 1e-6  # bilinear weights below are rounding: a point on a texel centre reads that texel alone


@dataclass(frozen=True, eq=False)
class Texels:
    """The texels of a UV layout that lie on the surface (conservative), N of them.

    Attributes:
        resolution: R, side of the map [texels].
        index: (N,) int32, row * R + column, ascending. Row 0 is the top: the centre of texel (r, c) is
            u = (c + 0.5) / R, v = 1 - (r + 0.5) / R.
        face: (N,) int32, the face that each texel shows.
        barycentric: (N, 3) float64, not negative, sum 1: the texel's centre if that lies in a face, else the
            point, nearest to it in the layout, of the nearest face that overlaps the texel.
        position: (N, 3) float64 [mesh units].
        inside: (N,) bool, true where the centre lies in a face.
        size: s, the edge of a texel on the surface [mesh units]: the median over the faces, not weighted and
            without degenerate ones, of sqrt(A_3D / (A_uv R^2)).
        chart: (F,) int32, the UV chart of each face: faces are in one chart if a chain of faces connects
            them in which neighbours share an edge, bit-identical in position and in UV.
        uv: (F, 3, 2) float32 in [0, 1], v upwards.
    """

    resolution: int
    index: np.ndarray
    face: np.ndarray
    barycentric: np.ndarray
    position: np.ndarray
    inside: np.ndarray
    size: float
    chart: np.ndarray
    uv: np.ndarray

    @staticmethod
    def rasterize(mesh: Mesh, uv: np.ndarray, resolution: int) -> Texels:
        """Finds the texels whose closed square overlaps a face.

        Among several faces one that contains the centre wins, else the nearest; of equals, the first.

        Args:
            mesh: F faces.
            uv: (F, 3, 2) in [0, 1], v upwards. Overlaps are not detected; see `mitex.atlas.usable_uv`.
            resolution: side of the map [texels], 1 to 8192.

        Raises:
            ConfigError: resolution or UVs out of range, or no texel is used.
            MeshError: no face has an area both in space and in the layout.
        """
        uv = np.ascontiguousarray(uv, np.float32)
        _check(mesh, uv, resolution)
        corners = texel_space(uv, resolution)
        face, distance = cover(corners, resolution)
        index = np.flatnonzero(face >= 0)
        if not len(index):
            raise ConfigError(f"the UVs of {mesh.name} cover no area", "unwrap the mesh again")
        face, inside = face[index], distance[index] == 0.0
        centre = np.stack([index % resolution, index // resolution], axis=1)
        barycentric = nearest_points(corners, face, centre, inside)
        return Texels(
            resolution=resolution,
            index=index.astype(np.int32),
            face=face,
            barycentric=barycentric,
            position=interpolate(barycentric, mesh.vertices[mesh.faces[face]]),
            inside=inside,
            size=_texel_size(mesh, corners),
            chart=charts(mesh, uv),
            uv=uv,
        )

    def bilinear(self, face: np.ndarray, barycentric: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """The texels that a bilinear lookup reads at points of the surface.

        Of the four texels around a point's UV, those that are not used or belong to another chart than the
        point are left out and the others' weights divided by their sum. Where none remains (slivers, and
        faces whose texel went to another chart), all weight goes to the chart's nearest texel among the 3 x 3
        around the point's own; else to the chart's texel nearest in the layout; and for charts without any
        texel, such as faces whose UVs coincide, to the texel nearest in the layout, whatever its chart.

        Args:
            face: (M,) the faces that the points lie on.
            barycentric: (M, 3) where on them.

        Returns:
            (M, 4) int32 texels in [0, N), 0 where the weight is 0, and (M, 4) float32 weights that sum to 1.
        """
        face, barycentric = np.asarray(face), np.asarray(barycentric, np.float64)
        texel = np.zeros((len(face), 4), np.int32)
        weight = np.zeros((len(face), 4), np.float32)
        for start in range(0, len(face), CHUNK):
            part = slice(start, start + CHUNK)
            texel[part], weight[part] = self._four(face[part], self._place(face[part], barycentric[part]))
        lost = np.flatnonzero(weight.sum(axis=1) == 0.0)
        if len(lost):
            texel[lost, 0] = self._one(face[lost], barycentric[lost])
            weight[lost, 0] = 1.0
        return texel, weight

    def image(self, values: np.ndarray, fill: float = 0.0) -> np.ndarray:
        """The map (R, R, C) with the values (N, C) at their texels and `fill` elsewhere."""
        image = np.full((self.resolution**2, values.shape[1]), fill, values.dtype)
        image[self.index] = values
        return image.reshape(self.resolution, self.resolution, -1)

    @cached_property
    def _number(self) -> np.ndarray:
        """(R * R,) int32, which of the N texels it is, -1 if not used."""
        number = np.full(self.resolution**2, -1, np.int32)
        number[self.index] = np.arange(len(self.index))
        return number

    def _place(self, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """(M, 2) float64 (column, row) of points on the surface."""
        return texel_space(interpolate(barycentric, self.uv[face].astype(np.float64)), self.resolution)

    def _of_chart(self, chart: np.ndarray, column: np.ndarray, row: np.ndarray) -> np.ndarray:
        """The numbers (M, k) of the texels at (M, k) places, -1 unless they are of the charts (M,)."""
        valid = (column >= 0) & (column < self.resolution) & (row >= 0) & (row < self.resolution)
        number = self._number[np.where(valid, row * self.resolution + column, 0)]
        same = self.chart[self.face[number]] == chart[:, None]
        return np.where(valid & (number >= 0) & same, number, -1)

    def _four(self, face: np.ndarray, place: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        corner = np.floor(place).astype(np.int64)
        across, down = (place - corner).T
        column = corner[:, :1] + (0, 1, 0, 1)
        row = corner[:, 1:] + (0, 0, 1, 1)
        weight = np.stack([1.0 - across, across, 1.0 - across, across], axis=1)
        weight *= np.stack([1.0 - down, 1.0 - down, down, down], axis=1)
        number = self._of_chart(self.chart[face], column, row)
        weight[(number < 0) | (weight < NO_WEIGHT)] = 0.0
        total = weight.sum(axis=1, keepdims=True)
        return np.where(weight > 0.0, number, 0), weight / np.where(total > 0.0, total, 1.0)

    def _one(self, face: np.ndarray, barycentric: np.ndarray) -> np.ndarray:
        """(M,) the texel that stands in where all four are of other charts; see `bilinear`."""
        place = self._place(face, barycentric)
        own = np.rint(place).astype(np.int64)
        column, row = own[:, :1] + np.arange(9) % 3 - 1, own[:, 1:] + np.arange(9) // 3 - 1
        number = self._of_chart(self.chart[face], column, row)
        away = (column - place[:, :1]) ** 2 + (row - place[:, 1:]) ** 2
        first = np.where(number >= 0, away, np.inf).argmin(axis=1)
        texel = np.take_along_axis(number, first[:, None], axis=1)[:, 0]
        far = np.flatnonzero(texel < 0)
        if len(far):
            texel[far] = self._nearest(self.chart[face[far]], place[far])
        return texel

    def _nearest(self, chart: np.ndarray, place: np.ndarray) -> np.ndarray:
        """(M,) the texels of charts (M,) nearest to (M, 2) places, of any chart for charts without texels."""
        own = self.chart[self.face]
        texel = np.empty(len(chart), np.int64)
        has_texels = np.isin(chart, own)
        # The chart as a third coordinate: with a spacing wider than the map, another is never nearer.
        for group, spacing in ((has_texels, 4.0 * self.resolution), (~has_texels, 0.0)):
            if group.any():
                row, column = np.divmod(self.index, self.resolution)
                tree = KDTree(np.stack([column, row, spacing * own], axis=1))
                query = np.column_stack([place[group], spacing * chart[group]])
                texel[group] = tree.query(query)[1]
        return texel


def charts(mesh: Mesh, uv: np.ndarray) -> np.ndarray:
    """(F,) int32 UV chart of each face of a layout (F, 3, 2), numbered by their first faces; see `Texels`."""
    vertex = welded(mesh.vertices)[mesh.faces].ravel()
    pairs = np.ascontiguousarray(uv.reshape(-1, 2) + np.float32(0.0)).view(np.int64)[:, 0]  # -0.0 becomes 0.0
    distinct, point = np.unique(pairs, return_inverse=True)
    _, corner = np.unique(vertex * len(distinct) + point, return_inverse=True)
    edges, sides = face_edges(corner.reshape(-1, 3), int(corner.max()) + 1)
    count = len(mesh.faces)
    face = np.repeat(np.arange(count), 3)
    real = sides.ravel() >= 0  # a side without a length is no edge
    links = (np.ones(real.sum(), np.int8), (face[real], count + sides.ravel()[real]))
    return connected_components(coo_array(links, (count + len(edges),) * 2), directed=False)[1][:count]


def _check(mesh: Mesh, uv: np.ndarray, resolution: int) -> None:
    most = TEXELS[1]
    if not 1 <= resolution <= most:
        raise ConfigError(f"texture resolution {resolution} is out of range", f"use 1 to {most}")
    if uv.shape != (len(mesh.faces), 3, 2):
        problem = f"UVs of shape {uv.shape} for {len(mesh.faces)} faces"
        raise ConfigError(problem, "give one pair per face corner, (F, 3, 2)")
    if not ((uv >= 0.0) & (uv <= 1.0)).all():
        raise ConfigError(f"UVs of {mesh.name} are outside of [0, 1]", "unwrap the mesh again")


def _texel_size(mesh: Mesh, corners: np.ndarray) -> float:
    area = np.linalg.norm(mesh.face_crosses, axis=1)
    texels = np.abs(twice_area(corners))
    solid = (area > 0.0) & (texels > FLAT)
    if not solid.any():
        raise MeshError(f"no face of {mesh.name} has an area", "check how it was exported")
    return float(np.median(np.sqrt(area[solid] / texels[solid])))
