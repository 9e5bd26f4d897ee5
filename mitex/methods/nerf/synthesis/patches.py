"""Patches of a surface (section 3.2.1): squares on tangent planes, cast onto the base shape.

All patches share one orientation, so that a direction on the surface means the same in each: their x axis is
a given direction, projected. Only the points where texels meet the shape are kept; what is asked of them,
features for one, is evaluated when it is needed.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from scipy.spatial import KDTree

from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import orthonormal
from mitex.mesh import Mesh
from mitex.mesh.sampling import DENSITY, apart, disk_distance, random_points
from mitex.mesh.topology import mesh_edges
from mitex.quilting.matching import HORIZONTAL, VERTICAL
from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.workers import tree_threads
from mitex.scenes.shapes import mesh_shape

SIZE = 128  # side of a patch [texels]
PATTERN_RATE = 1 / 8  # gap between texels [mean edges of the base shape]
LIFT = 0.1  # of the plane that the rays start from above the tangent plane [scene units]
MIN_FACING = 0.25  # cosine between a patch's z and the faces that it meets: they are stretched 4 times
SPARSE = 4  # every so many texels are compared with the scan, whose points are not denser
MAX_STEP = 1.0 / MIN_FACING  # between the depths of texels side by side; larger ones are a ledge [texel gaps]
CHUNK = 64  # patches cast at once


@dataclass(frozen=True, eq=False)
class Patches:
    """P squares of S x S texels on a base shape.

    Columns go along x and rows against y: row 0 is on top, where y points up.

    Attributes:
        points: (P, S, S, 3) float32 where the texels meet the shape [scene units].
        faces: (P, S, S) int32 faces there.
        frames: (P, 3, 3) float32 T_s, rows x, y and z in the scene, right-handed; z is the face's normal.
        centres: (P, 3) float32 middles of the squares, on the shape.
        gap: between texels [scene units].
    """

    points: np.ndarray
    faces: np.ndarray
    frames: np.ndarray
    centres: np.ndarray
    gap: float

    def __len__(self) -> int:
        return len(self.centres)

    @property
    def length(self) -> float:
        """Side of a patch [scene units]."""
        return self.gap * self.points.shape[1]


@dataclass(frozen=True, eq=False)
class FeatureSource:
    """Patches of features for `mitex.quilting.plane.quilt`, evaluated when asked for.

    Attributes:
        patches: where.
        features: (N, 3) points on the shape -> (N, C) values.
        matched: how many of the C channels are compared; the paper compares f, not f-hat.
    """

    patches: Patches
    features: Callable[[np.ndarray], np.ndarray]
    matched: int

    @property
    def centres(self) -> np.ndarray:
        return self.patches.centres

    @property
    def length(self) -> float:
        return self.patches.length

    def patch(self, index: int) -> np.ndarray:
        points = self.patches.points[index]
        values = np.asarray(self.features(points.reshape(-1, 3)), np.float32)
        return values.reshape(*points.shape[:2], -1)


def extract_patches(
    mesh: Mesh,
    rng: np.random.Generator,
    *,
    count: int = 2000,
    size: int = SIZE,
    pattern_rate: float = PATTERN_RATE,
    direction: np.ndarray | None = None,
    scan: np.ndarray | None = None,
    thickness: float = LIFT,
) -> Patches:
    """Patches at evenly spread points of a base shape.

    Left out are those that reach past a border of the shape, that lie over a fold or a ledge of it, where the
    texture would be broken, and those off the captured surface.

    Args:
        mesh: the base shape [scene units].
        rng: of the places.
        count: of places, roughly; at most so many.
        size: side of a patch, a multiple of 8 [texels].
        pattern_rate: gap between texels, of the mean edge of the mesh.
        direction: (3,) that the patches' x follows; the first principal component of the vertices if None.
        scan: (M, 3) points of the captured surface; patches whose plane is somewhere farther from them
            than 3 h, or 0.1 if that is less, are left out.
        thickness: h, half of the shell's [scene units].

    Raises:
        MeshError: the mesh has no area.
        ConfigError: a number is out of range, or no patch is left.
    """
    _check(count, size, pattern_rate, thickness)
    centres, seeds = spread_points(mesh, count, rng)
    z = mesh.face_normals[seeds]
    along = principal_direction(mesh) if direction is None else _checked_direction(direction)
    x = orthonormal(np.broadcast_to(along, z.shape).astype(np.float32), z)
    frames = np.stack([x, np.cross(z, x), z], 1).astype(np.float32)
    gap = texel_gap(mesh, pattern_rate)
    tree = None if scan is None else KDTree(np.asarray(scan, np.float32).reshape(-1, 3))
    caster = _Caster(mesh, gap, size, tree, min(LIFT, 3.0 * thickness))
    # Pages of the arrays that no patch is written to take no memory.
    points = np.empty((len(centres), size, size, 3), np.float32)
    faces = np.empty(points.shape[:-1], np.int32)
    indices = [np.zeros(0, np.int64)]
    filled = 0
    for start in range(0, len(centres), CHUNK):
        part = slice(start, start + CHUNK)
        good, hit_points, hit_faces = caster(centres[part], frames[part])
        end = filled + len(good)
        points[filled:end], faces[filled:end], filled = hit_points, hit_faces, end
        indices.append(start + good)
    if not filled:
        raise ConfigError(
            f"of {len(centres)} squares {gap * size:.3g} wide, none fits on {mesh.name}: {caster.reasons}",
            "use a smaller pattern rate",
        )
    index = np.concatenate(indices)
    return Patches(points[:filled], faces[:filled], frames[index], centres[index], gap)


def texel_gap(mesh: Mesh, pattern_rate: float) -> float:
    """Between texels of patches of a base shape [scene units]; arguments as of `extract_patches`."""
    pairs, _ = mesh_edges(mesh.faces, len(mesh.vertices))
    edges = np.linalg.norm(np.subtract(*mesh.vertices[pairs].swapaxes(0, 1)), axis=1)
    return float(edges.mean()) * pattern_rate


def mirror_frames(frames: np.ndarray, flip: np.ndarray) -> np.ndarray:
    """T_s of mirrored patches.

    What a patch shows on its right, its mirror image shows on its left. The tangent that the columns run
    along changes its sign with them, so that equation 4 gives the mirrored normal; for the rows likewise.

    Args:
        frames: (N, 3, 3), rows x, y and z.
        flip: (N,) bits as in `mitex.quilting.plane.Quilt`.

    Returns:
        (N, 3, 3), left-handed where one of the two is mirrored.
    """
    flip = np.asarray(flip)
    bits = np.stack([flip & HORIZONTAL, flip & VERTICAL, np.zeros_like(flip)], -1) > 0
    return np.where(bits[..., None], -frames, frames)


def principal_direction(mesh: Mesh) -> np.ndarray:
    """(3,) float64 unit vector along which the vertices vary most; its largest coordinate is positive."""
    offsets = mesh.vertices.astype(np.float64) - mesh.vertices.mean(0, dtype=np.float64)
    axis = np.linalg.eigh(offsets.T @ offsets)[1][:, -1]
    return axis * np.sign(axis[np.abs(axis).argmax()])


def spread_points(mesh: Mesh, count: int, rng: np.random.Generator) -> tuple[np.ndarray, np.ndarray]:
    """Poisson-disk points, by throwing darts.

    Returns:
        (N, 3) float32 points, N at most `count`, in random order, and (N,) the faces that they lie on.

    Raises:
        MeshError: the mesh has no area.
    """
    faces, weights = random_points(mesh, DENSITY * count, rng)
    points = interpolate(weights, mesh.vertices[mesh.faces[faces]])
    distance = disk_distance(mesh.face_areas.sum(dtype=np.float64), count)
    selection = apart(points, distance, most=count)
    return points[selection].astype(np.float32), faces[selection]


class _Caster:
    """Casts squares onto a mesh, and says which of them lie well on it."""

    def __init__(self, mesh: Mesh, gap: float, size: int, scan: KDTree | None, reach: float) -> None:
        init(needs="ad")
        self.gap, self.normals, self.scan, self.reach = gap, mesh.face_normals, scan, reach
        scene = {"type": "scene", "embree_use_robust_intersections": True, "mesh": mesh_shape(mesh)}
        self.scene = mi.load_dict(scene)
        place = gap * (np.arange(size) + 0.5 - 0.5 * size)
        self.offsets = np.stack(np.meshgrid(place, -place), -1).astype(np.float32)
        self.counts = Counter[str]()

    @property
    def reasons(self) -> str:
        """Why squares were left out, and how many."""
        return ", ".join(f"{count} {why}" for why, count in self.counts.items() if count)

    def __call__(self, centres: np.ndarray, frames: np.ndarray) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
        """Which of N squares lie well on the mesh, (K,), and where they meet it: points and faces."""
        plane = centres[:, None, None] + self.offsets @ frames[:, None, :2]
        z = frames[:, None, None, 2]
        depth, faces = self._cast(plane + LIFT * z, np.broadcast_to(z, plane.shape))
        hit = np.isfinite(depth).all((1, 2))
        even = hit & self._even(depth, faces, frames[:, 2])
        good = np.flatnonzero(even)
        near = self._near_scan(plane[good])
        good = good[near]
        self.counts.update(
            {
                "reach past its border": int((~hit).sum()),
                "bend or fold": int((hit & ~even).sum()),
                "lie off the captured surface": int((~near).sum()),
            }
        )
        return good, plane[good] + (LIFT - depth[good][..., None]) * z[good], faces[good]

    def _cast(self, origins: np.ndarray, z: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        """How far along -z the mesh is met, infinite where it is not, and in which faces."""
        origin, way = (np.ascontiguousarray(a.reshape(-1, 3).T, np.float32) for a in (origins, -z))
        rays = mi.Ray3f(mi.Point3f(origin), mi.Vector3f(way))
        hits = self.scene.ray_intersect_preliminary(rays, coherent=True)
        hit = hits.is_valid()
        dr.eval(hit, hits.t, hits.prim_index)
        hit = np.asarray(hit).astype(bool)
        depth = np.where(hit, np.asarray(hits.t), np.inf).astype(np.float32)
        faces = np.where(hit, np.asarray(hits.prim_index), 0).astype(np.int32)
        return depth.reshape(origins.shape[:-1]), faces.reshape(origins.shape[:-1])

    def _even(self, depth: np.ndarray, faces: np.ndarray, z: np.ndarray) -> np.ndarray:
        """(N,) bool, which squares see front sides only, none far below them, and no ledge."""
        facing = (self.normals[faces] @ z[:, None, :, None])[..., 0] > MIN_FACING
        with np.errstate(invalid="ignore"):  # rays that missed
            step = np.maximum(*(np.abs(np.diff(depth, axis=k)).max((1, 2)) for k in (1, 2)))
        return facing.all((1, 2)) & (depth.max((1, 2)) < 2.0 * LIFT) & (step < MAX_STEP * self.gap)

    def _near_scan(self, plane: np.ndarray) -> np.ndarray:
        """(N,) bool, which squares have points of the scan near every texel of their plane."""
        if self.scan is None:
            return np.ones(len(plane), bool)
        some = plane[:, SPARSE // 2 :: SPARSE, SPARSE // 2 :: SPARSE]
        workers = tree_threads(some.size // 3)
        distance, _ = self.scan.query(some, distance_upper_bound=self.reach, workers=workers)
        return np.isfinite(distance).all((1, 2))


def _check(count: int, size: int, pattern_rate: float, thickness: float) -> None:
    if count < 1 or size < 8 or size % 8:
        raise ConfigError(
            f"{count} patches of {size} x {size} texels", "use 1 or more, and sides that are multiples of 8"
        )
    if not (0.0 < pattern_rate < np.inf and 0.0 < thickness < np.inf):
        raise ConfigError(f"a pattern rate of {pattern_rate}, a shell of {thickness}", "use positive numbers")


def _checked_direction(direction: np.ndarray) -> np.ndarray:
    direction = np.asarray(direction, np.float64)
    if direction.shape != (3,) or not np.isfinite(direction).all() or not direction.any():
        raise ConfigError(f"a direction of {direction.tolist()}", "give three finite numbers, not all zero")
    return direction
