"""UV atlas: unwrapping a mesh, and which point of the surface every texel of a map shows."""

from __future__ import annotations

import weakref
from collections.abc import Iterator
from dataclasses import dataclass, replace

import numpy as np
from scipy.ndimage import distance_transform_edt

from mitex.charts import Packing, packed_charts
from mitex.errors import ConfigError, MeshError
from mitex.flat_charts import projected_charts, sides
from mitex.geometry.constant import constant, sealed
from mitex.geometry.normal_maps import FLAT, encode
from mitex.geometry.raster import covered_texels, rasterize
from mitex.geometry.tangents import Split, split_at_seams
from mitex.geometry.triangles import interpolate, twice_area
from mitex.geometry.vectors import scatter_add, unit
from mitex.mesh import Mesh
from mitex.progress import announce
from mitex.ranges import TEXELS

PADDING = 8  # texels by which charts are continued outwards, unless something else is said
LARGE = 40_000  # meshes of more faces are unwrapped in pieces
HUGE = 150_000  # meshes of more faces are projected: unwrapping takes a minute from here on
ROUGHNESS = 0.03  # by which vertices are moved before unwrapping [edge lengths], see `_rough`
STRIP = 1 << 18  # texels
OVERLAP_SIDE = 512  # of the raster on which overlaps are counted [texels]
FULL = 1.001  # the area of the unit square, and some rounding

_layouts: weakref.WeakKeyDictionary[Mesh, dict[tuple[int, int], np.ndarray]] = weakref.WeakKeyDictionary()


@dataclass(frozen=True, eq=False)
class Atlas:
    """A square UV layout and its texels. Immutable: the arrays that it is made of become read-only.

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

    def __post_init__(self) -> None:
        for array in (self.uv, self.face, self.barycentric, self.inside):
            sealed(array)

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
        used = self.face >= 0
        values = interpolate(self.barycentric[used], corners.astype(np.float32, copy=False)[self.face[used]])
        image = np.empty((*self.face.shape, corners.shape[2]), np.float32)
        image[used] = values
        image[~used] = values.mean(axis=0) if len(values) else 0.0
        return image

    def normal_map(self, mesh: Mesh, detail: np.ndarray) -> np.ndarray:
        """The normal map of the layout.

        Args:
            mesh: that the layout belongs to.
            detail: (N, N, 3) detail normals in object space, of any length; anything where no chart is near.

        Returns:
            (N, N, 3) float32 in [0, 1], in the `shading_frames`.
        """
        split = split_at_seams(mesh, self.uv)
        encoded = np.empty(detail.shape, np.float32)
        for rows in self.strips():
            strip = self._strip(rows)
            encoded[rows] = encode(unit(detail[rows]), *strip._frames(split))
            encoded[rows][strip.face < 0] = FLAT
        return encoded

    def shading_frames(self, mesh: Mesh) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """(N, N, 3) tangents, bitangents and normals as shaders that follow MikkTSpace have them.

        Tangent and normal are interpolated and not normalised; the bitangent is sign * cross(normal, tangent)
        in each texel.
        """
        return self._frames(split_at_seams(mesh, self.uv))

    def strips(self) -> Iterator[slice]:
        """Rows in strips of about `STRIP` texels: what is computed of one stays in the cache."""
        height = max(STRIP // self.resolution, 1)
        for top in range(0, self.resolution, height):
            yield slice(top, min(top + height, self.resolution))

    def points(self, rows: slice) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """What the texels of some rows show, none of it beyond its face.

        Returns:
            (n, N) bool, which texels show a point; (P,) faces and (P, 3) barycentrics of those.
        """
        used = self.face[rows] >= 0
        barycentric = self.barycentric[rows][used].clip(0)
        return used, self.face[rows][used], barycentric / barycentric.sum(axis=1, keepdims=True)

    def _strip(self, rows: slice) -> Atlas:
        return Atlas(self.uv, self.face[rows], self.barycentric[rows], self.inside[rows])

    def _frames(self, split: Split) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        tangent, normal = (self.interpolate(v[split.faces]) for v in (split.tangents[:, :3], split.normals))
        sign = split.tangents[split.faces[:, 0], 3][self.face][..., None]
        return tangent, sign * np.cross(normal, tangent), normal

    @staticmethod
    def build(
        mesh: Mesh, resolution: int = 1024, padding: int = PADDING, layout: np.ndarray | None = None
    ) -> Atlas:
        """Unwraps a mesh, or takes its own UVs if they are usable (`usable_uv`), and rasterizes the texels.

        Args:
            mesh: any mesh.
            resolution: side of the map [texels], 16 to 8192.
            padding: how far the charts are continued outwards [texels]. Bilinear lookups need 1, the k-th
                mip level 2^k.
            layout: (F, 3, 2) UVs to take as they are.

        Raises:
            ConfigError: resolution or padding out of range.
            MeshError: as `laid_out`, unless there is a layout.
        """
        least, most = TEXELS
        if not least <= resolution <= most:
            raise ConfigError(f"texture resolution {resolution} is out of range", f"use {least} to {most}")
        if not 1 <= padding <= resolution // 8:
            raise ConfigError(f"padding {padding} is out of range", f"use 1 to {resolution // 8} texels")
        uv = laid_out(mesh, resolution, padding).uv if layout is None else layout
        assert uv is not None
        return Atlas.from_uv(uv, resolution, padding)

    @staticmethod
    def from_uv(uv: np.ndarray, resolution: int, padding: int = PADDING) -> Atlas:
        """Rasterizes a given layout; where faces overlap, one of them wins.

        Args:
            uv: (F, 3, 2) in [0, 1], v upwards.
            resolution, padding: as in `build`.
        """
        face, barycentric, distance = rasterize(uv, resolution)
        nearest = np.zeros((2, *face.shape), np.int32)
        away = np.asarray(distance_transform_edt(face < 0, return_indices=True, indices=nearest))
        row, column = nearest
        source = face[row, column]
        near = away <= padding
        return Atlas(
            uv=constant(uv, np.float32),
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

    Returns:
        (N, N, C).
    """
    nearest = np.zeros((2, *used.shape), np.int32)
    away = np.asarray(distance_transform_edt(~used, return_indices=True, indices=nearest))
    filled = image[nearest[0], nearest[1]]
    filled[away > padding] = image[used].mean(axis=0)
    return filled


def unwrap(mesh: Mesh, resolution: int, padding: int) -> np.ndarray:
    """Cuts the mesh into charts and packs them into the unit square (xatlas); kept as long as the mesh lives.

    Charts are flattened, or, on meshes of more than `HUGE` faces, projected along an axis.

    Args:
        mesh: any mesh; degenerate faces get (0, 0).
        resolution: side of the map that the charts are packed for [texels].
        padding: gap between charts [texels].

    Returns:
        (F, 3, 2) float32 in [0, 1], v upwards, read-only. Charts may be mirrored.

    Raises:
        MeshError: as `mitex.charts.packed_charts`.
    """
    layouts = _layouts.setdefault(mesh, {})
    if (resolution, padding) not in layouts:
        layouts[resolution, padding] = sealed(_unwrapped(mesh, resolution, padding))
    return layouts[resolution, padding]


def _unwrapped(mesh: Mesh, resolution: int, padding: int) -> np.ndarray:
    """What `unwrap` keeps."""
    announce("unwrapping the mesh")
    # xatlas has absolute tolerances; a power of two changes no digits.
    extent = float(np.ptp(mesh.vertices, axis=0).max())
    if extent > 0:
        mesh = mesh.with_vertices(mesh.vertices * 2.0 ** -np.rint(np.log2(extent / 2)))
    # xatlas only estimates the texel size and packs into up to 1.4 times the side asked for.
    packing = Packing(resolution, int(np.ceil(1.4 * padding)))
    if len(mesh.faces) > HUGE:
        return projected_charts(mesh, packing)[0]
    return _flattened(mesh, packing)


def _flattened(mesh: Mesh, packing: Packing) -> np.ndarray:
    """The charts of xatlas, in the unit square (F, 3, 2)."""
    pieces, positions, parts = _pieces(mesh), _rough(mesh), []
    for piece in pieces:
        used, faces = np.unique(mesh.faces[piece], return_inverse=True)
        parts.append((positions[used], faces.reshape(-1, 3)))
    # Flattening a chart takes more than linear time; this keeps a mesh of 20k faces at one or two seconds.
    packing = replace(packing, largest=0.1 * float(mesh.face_areas.sum()))
    result = np.empty((len(mesh.faces), 3, 2), np.float32)
    for piece, corners in zip(pieces, packed_charts(parts, packing, mesh.name), strict=True):
        result[piece] = corners
    return result


def _pieces(mesh: Mesh) -> list[np.ndarray]:
    """Indices of the faces that are flattened together: large meshes in six parts, which takes less time.

    A face belongs to the part of the axis (+-x, +-y, +-z) that it looks along, after the normals have been
    smoothed over the neighbours.
    """
    if len(mesh.faces) <= LARGE:
        return [np.arange(len(mesh.faces))]
    side = sides(mesh)
    return [piece for k in range(6) if len(piece := np.flatnonzero(side == k))]


def _rough(mesh: Mesh) -> np.ndarray:
    """Positions (V, 3), of large meshes moved along the normals by up to 3 % of the edges around.

    xatlas takes faces that are nearly parallel to their neighbours for flat, and grows its first charts over
    them without end: around whole spheres, if these are fine enough, until the stack is exhausted.
    """
    if len(mesh.faces) <= LARGE:
        return mesh.vertices
    edges = mesh.vertices[mesh.edges.indices] - mesh.vertices[mesh.edges.rows]
    length = scatter_add(mesh.edges.rows, np.linalg.norm(edges, axis=1, keepdims=True), len(mesh.vertices))
    length /= np.maximum(np.diff(mesh.edges.indptr), 1)[:, None]
    shift = np.random.default_rng(0).uniform(-ROUGHNESS, ROUGHNESS, (len(mesh.vertices), 1))
    return (mesh.vertices + shift * length * mesh.normals).astype(np.float32)


def laid_out(mesh: Mesh, resolution: int, padding: int = PADDING) -> Mesh:
    """The mesh with UVs that can carry a map: its own if they are usable (`usable_uv`), else new ones.

    A mesh that is going to be subdivided is best laid out before: subdivision keeps the UVs, and the coarse
    mesh takes a tenth of the time.

    Args:
        mesh: any mesh.
        resolution: side of the map [texels].
        padding: gap between new charts [texels].

    Raises:
        MeshError: the mesh has no area, or as `unwrap`.
    """
    if not mesh.face_areas.sum() > 0.0:
        raise MeshError(f"{mesh.name} has no area to put a texture on", "give a surface")
    if mesh.uv is not None and usable_uv(mesh, mesh.uv):
        return mesh
    return replace(mesh, uv=unwrap(mesh, resolution, padding))


def usable_uv(mesh: Mesh, uv: np.ndarray) -> bool:
    """Whether a layout can carry a map of its own: in [0, 1], no part missing, no two faces overlapping.

    Args:
        mesh: the mesh.
        uv: (F, 3, 2) layout.
    """
    if not np.isfinite(uv).all() or uv.min() < 0.0 or uv.max() > 1.0:
        return False
    flat = np.abs(twice_area(uv)) < 1e-12
    if mesh.face_areas[flat].sum() > 1e-3 * mesh.face_areas.sum():
        return False
    if np.abs(twice_area(uv)).sum() > 2 * FULL:  # more than fits side by side: no need to look
        return False
    count = np.zeros(OVERLAP_SIDE * OVERLAP_SIDE, np.int32)
    for _, texel, barycentric in covered_texels(uv, OVERLAP_SIDE):
        # Strictly inside: faces of one chart share their edges.
        count += np.bincount(texel[barycentric.min(axis=1) > 1e-3], minlength=count.size).astype(np.int32)
    return bool((count > 1).sum() <= 1e-3 * max((count > 0).sum(), 1))
