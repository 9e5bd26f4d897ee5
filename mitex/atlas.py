"""UV atlas: unwrapping a mesh, and which point of the surface every texel of a map shows."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
import xatlas
from scipy.ndimage import distance_transform_edt

from mitex.errors import ConfigError
from mitex.mesh import Mesh

MAX_RESOLUTION = 8192
LARGE = 40_000  # meshes of more faces are unwrapped in pieces
SMOOTHINGS = 8
ROUGHNESS = 0.03  # [edge lengths]
CHUNK = 4_000_000  # candidate texels that are looked at together; bounds the memory at about 300 MB
FULL = 1.001  # area of the unit square, and rounding
RING = 1.0  # [texel] how far outside a triangle its own plane is still continued, see `_rasterize`


@dataclass(frozen=True, eq=False)
class Atlas:
    """A square UV layout and its texels.

    Row 0 of a map is its top: texel (r, c) of N x N shows u = (c + 0.5) / N, v = 1 - (r + 0.5) / N.

    Attributes:
        uv: (F, 3, 2) float32 in [0, 1], per face corner, v upwards.
        face: (N, N) int32, the face that a texel shows, -1 where no chart is within the padding.
        barycentric: (N, N, 3) float32, where on that face. Texels in a chart's padding hold the nearest
            point of the chart, or, right at its border, continue the face a little: weights may then be
            slightly negative.
        inside: (N, N) bool, true where the texel's centre lies in a chart.
    """

    uv: np.ndarray
    face: np.ndarray
    barycentric: np.ndarray
    inside: np.ndarray

    @property
    def resolution(self) -> int:
        """Side of the square [texels]."""
        return self.face.shape[0]

    def interpolate(self, corners: np.ndarray) -> np.ndarray:
        """A map from values at the face corners; `values[mesh.faces]` makes them from vertex values.

        Args:
            corners: (F, 3, C) values.

        Returns:
            (N, N, C) float32. Texels far from every chart get the mean of the map, so that small mip levels
            keep its colour.
        """
        shown = self.face >= 0
        picked = corners.astype(np.float32, copy=False)[self.face[shown]]
        values = np.einsum("nk,nkc->nc", self.barycentric[shown], picked)
        image = np.empty((*self.face.shape, corners.shape[2]), np.float32)
        image[shown] = values
        image[~shown] = values.mean(axis=0) if len(values) else 0.0
        return image

    @staticmethod
    def build(mesh: Mesh, resolution: int = 1024, padding: int = 8) -> Atlas:
        """Unwraps a mesh, or takes its own UVs if they are usable (`usable_uv`), and rasterizes the texels.

        Args:
            mesh: any mesh.
            resolution: side of the map [texels], 16 to 8192.
            padding: how far the charts are continued outwards [texels]. Bilinear lookups need 1, the k-th
                mip level 2^k.

        Raises:
            ConfigError: resolution or padding out of range.
        """
        if not 16 <= resolution <= MAX_RESOLUTION:
            raise ConfigError(
                f"texture resolution {resolution} is out of range", f"use 16 to {MAX_RESOLUTION}"
            )
        if not 1 <= padding <= resolution // 8:
            raise ConfigError(f"padding {padding} is out of range", f"use 1 to {resolution // 8} texels")
        uv = laid_out(mesh, resolution, padding).uv
        assert uv is not None
        return Atlas.from_uv(uv, resolution, padding)

    @staticmethod
    def from_uv(uv: np.ndarray, resolution: int, padding: int = 8) -> Atlas:
        """Rasterizes a given layout; where faces overlap, one of them wins.

        Args:
            uv: (F, 3, 2) in [0, 1], v upwards.
            resolution, padding: as in `build`.
        """
        face, barycentric, distance = _rasterize(uv, resolution)
        nearest = np.zeros((2, *face.shape), np.int32)
        away = np.asarray(distance_transform_edt(face < 0, return_indices=True, indices=nearest))
        row, column = nearest
        source = face[row, column]
        near = away <= padding
        return Atlas(
            uv=np.ascontiguousarray(uv, np.float32),
            face=np.where(near, source, -1).astype(np.int32),
            barycentric=np.where(near[..., None], barycentric[row, column], 0.0).astype(np.float32),
            inside=(face >= 0) & (distance == 0),
        )


def spread(image: np.ndarray, used: np.ndarray, padding: int) -> np.ndarray:
    """The image continued outwards from its used texels, so that filtered lookups show no seam.

    Args:
        image: (N, N, C).
        used: (N, N) bool.
        padding: how far [texels]; texels farther away get the mean of the used ones.
    """
    nearest = np.zeros((2, *used.shape), np.int32)
    away = np.asarray(distance_transform_edt(~used, return_indices=True, indices=nearest))
    filled = image[nearest[0], nearest[1]]
    filled[away > padding] = image[used].mean(axis=0)
    return filled


def unwrap(mesh: Mesh, resolution: int, padding: int) -> np.ndarray:
    """Cuts the mesh into charts and packs them into the unit square (xatlas).

    Args:
        mesh: any mesh; degenerate faces get (0, 0).
        resolution: side of the map that the charts are packed for [texels].
        padding: gap between charts [texels].

    Returns:
        (F, 3, 2) float32 in [0, 1], v upwards. Charts may be mirrored.
    """
    atlas = xatlas.Atlas()
    # xatlas has absolute tolerances; a power of two changes no digits.
    extent = float(np.ptp(mesh.vertices, axis=0).max())
    if extent > 0:
        mesh = mesh.with_vertices(mesh.vertices * 2.0 ** -np.rint(np.log2(extent / 2)))
    pieces, positions = _pieces(mesh), _rough(mesh)
    for piece in pieces:
        used, faces = np.unique(mesh.faces[piece], return_inverse=True)
        atlas.add_mesh(positions[used], faces.reshape(-1, 3).astype(np.uint32))
    pack = xatlas.PackOptions()
    pack.resolution = resolution
    # xatlas only estimates the texel size and packs into up to 1.4 times the side asked for.
    pack.padding = int(np.ceil(1.4 * padding))
    pack.bilinear = True
    chart = xatlas.ChartOptions()
    # Flattening a chart takes more than linear time; this keeps a mesh of 20k faces at one or two seconds.
    chart.max_chart_area = 0.1 * float(mesh.face_areas.sum())
    atlas.generate(chart, pack)
    # Back to texels and down by one factor, so that texels stay square.
    side = np.array([atlas.width, atlas.height], np.float32)
    result = np.empty((len(mesh.faces), 3, 2), np.float32)
    for k, piece in enumerate(pieces):
        _, corners, uv = atlas.get_mesh(k)
        result[piece] = np.clip(uv * side / side.max(), 0.0, 1.0)[corners.astype(np.int64)]
    return result


def _pieces(mesh: Mesh) -> list[np.ndarray]:
    """Indices of the faces that are flattened together: large meshes in six parts, which takes less time.

    They are cut along the directions that the faces look at, after these are smoothed over the neighbours.
    """
    if len(mesh.faces) <= LARGE:
        return [np.arange(len(mesh.faces))]
    normals = mesh.normals
    for _ in range(SMOOTHINGS):
        normals = normals + _summed(mesh, normals[mesh.edges.indices])
    towards = normals[mesh.faces].sum(1)
    axis = np.abs(towards).argmax(1)
    side = 2 * axis + (np.take_along_axis(towards, axis[:, None], 1)[:, 0] > 0)
    return [piece for k in range(6) if len(piece := np.flatnonzero(side == k))]


def _rough(mesh: Mesh) -> np.ndarray:
    """Positions (V, 3), of large meshes moved along the normals by up to 3 % of the edges around.

    xatlas takes faces nearly parallel to their neighbours for flat and grows its first charts over them
    without an end, around whole spheres if they are fine enough, and exhausts the stack.
    """
    if len(mesh.faces) <= LARGE:
        return mesh.vertices
    edges = mesh.vertices[mesh.edges.indices] - mesh.vertices[mesh.edges.rows]
    length = _summed(mesh, np.linalg.norm(edges, axis=1, keepdims=True))
    length /= np.maximum(np.diff(mesh.edges.indptr), 1)[:, None]
    shift = np.random.default_rng(0).uniform(-ROUGHNESS, ROUGHNESS, (len(mesh.vertices), 1))
    return (mesh.vertices + shift * length * mesh.normals).astype(np.float32)


def _summed(mesh: Mesh, values: np.ndarray) -> np.ndarray:
    """(V, C) sums of values (E, C) of the directed edges over those that each vertex receives."""
    count = len(mesh.vertices)
    return np.stack([np.bincount(mesh.edges.rows, column, count) for column in values.T], axis=1)


def laid_out(mesh: Mesh, resolution: int, padding: int = 8) -> Mesh:
    """The mesh with UVs for a map of `resolution` [texels]: its own if they are usable, else new ones.

    Subdivision keeps UVs, and laying out the coarse mesh takes a tenth of the time.
    """
    if mesh.uv is not None and usable_uv(mesh, mesh.uv):
        return mesh
    return replace(mesh, uv=unwrap(mesh, resolution, padding))


def usable_uv(mesh: Mesh, uv: np.ndarray, resolution: int = 512) -> bool:
    """Whether a layout can carry a map of its own: in [0, 1], no part missing, no two faces overlapping.

    Args:
        mesh: the mesh.
        uv: (F, 3, 2) layout.
        resolution: side of the raster on which overlaps are counted [texels].
    """
    if not np.isfinite(uv).all() or uv.min() < 0.0 or uv.max() > 1.0:
        return False
    flat = np.abs(twice_area(uv)) < 1e-12
    if mesh.face_areas[flat].sum() > 1e-3 * mesh.face_areas.sum():
        return False
    if np.abs(twice_area(uv)).sum() > 2 * FULL:  # more than fits side by side: no need to look
        return False
    count = np.zeros(resolution * resolution, np.int32)
    for _, texel, barycentric in _candidates(uv, resolution):
        # Strictly inside: faces of one chart share their edges.
        count += np.bincount(texel[barycentric.min(axis=1) > 1e-3], minlength=count.size).astype(np.int32)
    return bool((count > 1).sum() <= 1e-3 * max((count > 0).sum(), 1))


def twice_area(p: np.ndarray) -> np.ndarray:
    """(F,) twice the signed areas of triangles (F, 3, 2)."""
    a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    return a[:, 0] * b[:, 1] - a[:, 1] * b[:, 0]


def texel_space(uv: np.ndarray, resolution: int) -> np.ndarray:
    """UVs (..., 2) as (column, row), float64; texel centres are at the integers."""
    flipped = np.stack([uv[..., 0], 1.0 - uv[..., 1].astype(np.float64)], axis=-1)
    return flipped * resolution - 0.5


def texels_in_boxes(
    low: np.ndarray, high: np.ndarray, chunk: int = CHUNK
) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yields (face, column, row) of the texels in each face's box, about `chunk` texels at a time.

    Args:
        low, high: (F, 2) int64 first and last (column, row); a face is left out where `high` is below `low`.
        chunk: a box larger than that is cut between its rows.
    """
    size = np.maximum(high - low + 1, 0)
    for chosen in _portions(size.prod(axis=1), chunk):
        of, row = _counted(size[chosen, 1])
        strip = chosen[of]
        for part in _portions(size[strip, 0], chunk):
            of, column = _counted(size[strip[part], 0])
            face = strip[part][of]
            yield face, column + low[face, 0], row[part][of] + low[face, 1]


def _portions(count: np.ndarray, chunk: int) -> Iterator[np.ndarray]:
    """Yields the indices of the positive counts in order, as many together as sum to about `chunk`."""
    index = np.flatnonzero(count)
    group = np.cumsum(count[index]) // chunk
    if len(index):
        yield from np.split(index, np.flatnonzero(np.diff(group)) + 1)


def _counted(count: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Index k repeated count[k] times, and the numbers 0 to count[k] - 1 beside it."""
    index = np.repeat(np.arange(len(count)), count)
    return index, np.arange(len(index)) - np.repeat(np.cumsum(count) - count, count)


def _candidates(uv: np.ndarray, resolution: int) -> Iterator[tuple[np.ndarray, np.ndarray, np.ndarray]]:
    """Yields (face, texel, barycentric) of the texels in each face's bounding box and a ring around it."""
    p = texel_space(uv, resolution).astype(np.float32)
    area = twice_area(p)
    low = np.clip(np.ceil(p.min(axis=1) - RING), 0, resolution - 1).astype(np.int64)
    high = np.clip(np.floor(p.max(axis=1) + RING), 0, resolution - 1).astype(np.int64)
    high[np.abs(area) <= 1e-7] = -1
    # Affine in the texel: two gradients per face instead of three areas per texel.
    origin, gradient = barycentric_gradients(p, area)
    for face, column, row in texels_in_boxes(low, high):
        dx = column.astype(np.float32) - origin[face, 0]
        dy = row.astype(np.float32) - origin[face, 1]
        b1 = gradient[face, 0] * dx + gradient[face, 1] * dy
        b2 = gradient[face, 2] * dx + gradient[face, 3] * dy
        yield face, row * resolution + column, np.stack([1.0 - b1 - b2, b1, b2], axis=1)


def barycentric_gradients(p: np.ndarray, area: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """First corners (F, 2) and gradients (F, 4), (db1/dx, db1/dy, db2/dx, db2/dy), of triangles (F, 3, 2).

    Args:
        p: the triangles.
        area: (F,) their `twice_area`.
    """
    a, b = p[:, 1] - p[:, 0], p[:, 2] - p[:, 0]
    inverse = np.divide(1.0, area, out=np.zeros_like(area), where=area != 0)[:, None]
    return p[:, 0], np.stack([b[:, 1], -b[:, 0], -a[:, 1], a[:, 0]], axis=1) * inverse


def _rasterize(uv: np.ndarray, resolution: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Face, barycentrics and distance [texels] of the texels in or within `RING` of a chart.

    A bilinear lookup at a chart's border also reads texels whose centres lie just outside. Those continue
    the nearest face linearly, which makes the lookup exact at the border; the continuation is limited to
    half an edge, for faces smaller than a texel.
    """
    p = texel_space(uv, resolution).astype(np.float32)
    texels = resolution * resolution
    best = np.full(texels, np.inf, np.float32)
    face = np.full(texels, -1, np.int32)
    barycentric = np.zeros((texels, 3), np.float32)
    for candidate, texel, weight in _candidates(uv, resolution):
        distance = _distance(p, candidate, texel, weight, resolution)
        keep = np.flatnonzero(distance < best[texel])
        keep = keep[distance[keep] <= RING * np.sqrt(2.0)]
        keep = keep[np.argsort(-distance[keep], kind="stable")]  # the last, nearest one is written
        best[texel[keep]] = distance[keep]
        face[texel[keep]] = candidate[keep]
        limited = np.maximum(weight[keep], -0.5)
        barycentric[texel[keep]] = limited / limited.sum(axis=1, keepdims=True)
    shape = (resolution, resolution)
    return face.reshape(shape), barycentric.reshape(*shape, 3), best.reshape(shape)


def _distance(
    p: np.ndarray, face: np.ndarray, texel: np.ndarray, barycentric: np.ndarray, resolution: int
) -> np.ndarray:
    """Distance from texel centres to faces [texels], 0 inside, infinite when surely beyond the ring."""
    edge = p[:, [2, 0, 1]] - p[:, [1, 2, 0]]  # opposite to each corner
    length2 = np.maximum((edge**2).sum(axis=2), 1e-20)
    height = np.abs(twice_area(p))[:, None] / np.sqrt(length2)
    outside = -(barycentric * height[face]).min(axis=1)
    distance = np.where(barycentric.min(axis=1) >= -1e-6, 0.0, np.inf).astype(np.float32)
    ring = np.flatnonzero((distance > 0) & (outside <= 1.5 * RING))
    point = np.stack([texel[ring] % resolution, texel[ring] // resolution], axis=1).astype(np.float32)
    for k in range(3):
        to = point - p[face[ring], (k + 1) % 3]
        along = edge[face[ring], k]
        t = np.clip((to * along).sum(axis=1) / length2[face[ring], k], 0.0, 1.0)
        distance[ring] = np.minimum(distance[ring], np.linalg.norm(to - t[:, None] * along, axis=1))
    return distance
