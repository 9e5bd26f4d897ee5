"""The exponential map of a triangle mesh: straightest geodesics, walked by unfolding face after face.

Kovacs et al. 2024, section 3.1: the taps d of a convolution at a point x are read at exp_x(s d), where s is
the size of a texel (equation 3).
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.methods.surface.unfolding import unfold
from mitex.runtime import load_mitsuba
from mitex.runtime.jit import dr
from mitex.runtime.upload import upload

# isort: split
from drjit.llvm import Array2f64, Array3f64, Bool, Float64, Int32, UInt32  # after Mitex's choice of LLVM

# A bound for walks that turn around the tip of a needle-sharp cone; a great circle on a sphere of a million
# even faces crosses about 2,600 of them.
MAX_CROSSINGS = 100_000
# Rays in memory at once; each takes about 200 bytes.
CHUNK = 1 << 22
# Barycentric coordinates may be as inexact as float32 makes them.
TOLERANCE = 1e-5
# A direction that leaves less than this part of itself in the plane of its face is along the normal.
NORMAL = 1e-12


@dataclass(frozen=True, eq=False)
class Arrival:
    """The last points of M walks.

    Attributes:
        face: (M,) int32.
        barycentric: (M, 3) float64, at least 0 with the sum 1.
        arrived: (M,) bool; False where the walk met a boundary, or could not start or go on: then `face` and
            `barycentric` are the last point that it reached.
    """

    face: np.ndarray
    barycentric: np.ndarray
    arrived: np.ndarray


class GeodesicTracer:
    """Straightest geodesics on a triangle mesh by unfolding, exact up to float64 rounding.

    A walk is a straight line in the plane that the faces it crosses unfold to. Through a vertex it goes on
    with the angle pi on one side, either one. Windings may disagree. Boundaries are as `unfold` says. Faces
    of no area are walked through like the seams they are, but no walk starts on one.

    Args:
        mesh: F faces.

    Raises:
        RuntimeUnavailable: no usable LLVM.
    """

    def __init__(self, mesh: Mesh) -> None:
        load_mitsuba()
        plan = unfold(mesh)
        self._faces = len(mesh.faces)
        self._planes = _Planes(
            upload(Float64, plan.shape.ravel()),
            upload(Float64, plan.axes.ravel()),
            upload(Int32, plan.glued.ravel()),
        )

    def trace(
        self, face: ArrayLike, barycentric: ArrayLike, direction: ArrayLike, length: ArrayLike
    ) -> Arrival:
        """Walks M rays.

        Args:
            face: (M,) integers in [0, F), where the walks start.
            barycentric: (M, 3), at least 0 with the sum 1.
            direction: (M, 3) in object space, of any length; projected on the plane of the face. A walk does
                not start (`arrived` is False) where nothing is left of it.
            length: (M,) or one number, at least 0 [mesh units].

        Raises:
            ConfigError: shapes that do not fit, a face that does not exist, a number that is not finite, a
                negative length, or barycentric coordinates of no point in the face.
        """
        start, weights, towards, reach = _checked(face, barycentric, direction, length, self._faces)
        # int32 first: `concatenate` of nothing would be float64.
        parts = [Arrival(np.empty(0, np.int32), np.empty((0, 3)), np.empty(0, bool))]
        for first in range(0, len(start), CHUNK):
            part = slice(first, first + CHUNK)
            parts.append(self._trace(start[part], weights[part], towards[part], reach[part]))
        return Arrival(
            np.concatenate([p.face for p in parts]),
            np.concatenate([p.barycentric for p in parts]),
            np.concatenate([p.arrived for p in parts]),
        )

    def _trace(
        self, face: np.ndarray, barycentric: np.ndarray, direction: np.ndarray, length: np.ndarray
    ) -> Arrival:
        index = dr.arange(UInt32, len(face))
        start = dr.gather(Array3f64, upload(Float64, barycentric.ravel()), index)
        towards = dr.gather(Array3f64, upload(Float64, direction.ravel()), index)
        walk = self._planes.start(upload(Int32, face), start, towards, upload(Float64, length))
        started = Bool(walk.active)
        (walk,) = dr.while_loop((walk,), lambda w: w.active, self._planes.step)
        # Faces without an area cannot tell a point's coordinates, so a walk that never started keeps its own.
        weights = dr.select(started, _barycentric(walk.shape, walk.point), start)
        flat = Float64(dr.ravel(weights))
        dr.eval(walk.face, flat, walk.arrived)
        return Arrival(walk.face.numpy(), flat.numpy().reshape(-1, 3), walk.arrived.numpy())


@dataclass
class _Walk:
    """The state of rays, in the planes of their faces; see `Unfolding`."""

    face: Int32
    shape: Array3f64
    point: Array2f64
    direction: Array2f64  # unit
    left: Float64  # of the length
    entered: Int32  # the side that the ray came in by, or -1
    crossings: UInt32
    active: Bool
    arrived: Bool


@dataclass(frozen=True, eq=False)
class _Exit:
    """The side that a ray leaves its face by, or -1, and where."""

    side: Int32
    fraction: Float64  # of the side
    point: Array2f64
    distance: Float64
    along: Float64  # the direction in the frame of the side, times the length of the side
    outward: Float64


class _Planes:
    """An `Unfolding` on the device, and one step of a walk on it."""

    def __init__(self, shape: Float64, axes: Float64, glued: Int32) -> None:
        self.shape, self.axes, self.glued = shape, axes, glued

    def start(self, face: Int32, weights: Array3f64, direction: Array3f64, length: Float64) -> _Walk:
        shape = dr.gather(Array3f64, self.shape, face)
        size = dr.max(dr.abs(direction))
        direction = direction / dr.select(size > 0.0, size, 1.0)  # before squares overflow
        x, y = (dr.dot(dr.gather(Array3f64, self.axes, 2 * face + k), direction) for k in range(2))
        norm = dr.sqrt(x * x + y * y)
        ready = norm > NORMAL
        point = Array2f64(weights.y * shape.x + weights.z * shape.y, weights.z * shape.z)
        unit = Array2f64(x, y) / dr.select(ready, norm, 1.0)
        return _Walk(face, shape, point, unit, length, Int32(-1), UInt32(0), ready, Bool(False))

    def step(self, walk: _Walk) -> tuple[_Walk]:
        """Goes to the end of the ray or to the next face."""
        way = _exit(walk)
        has_exit = way.side >= 0
        inside = has_exit & (way.distance >= walk.left)
        leaves = has_exit & ~inside
        target = dr.gather(Int32, self.glued, 3 * walk.face + way.side, walk.active & leaves)
        walk.crossings += 1
        last = dr.select(inside, walk.point + walk.left * walk.direction, way.point)
        walk.point = dr.select(has_exit, last, walk.point)
        crosses = leaves & (target >= 0) & (walk.crossings <= MAX_CROSSINGS)
        self._enter(walk, way, target, crosses)
        walk.arrived |= inside
        walk.active &= crosses
        return (walk,)

    def _enter(self, walk: _Walk, way: _Exit, target: Int32, crosses: Bool) -> None:
        """Moves to the plane of the next face. Its inside is to the left of the side that is entered."""
        same = (target & 1) == 1
        face = (target >> 1) // 3
        side = (target >> 1) - 3 * face
        shape = dr.gather(Array3f64, self.shape, face, walk.active & crosses)
        a, b = _side(shape, side)
        edge = b - a
        fraction = dr.select(same, way.fraction, 1.0 - way.fraction)
        along = dr.select(same, way.along, -way.along)
        unfolded = (along * edge + way.outward * Array2f64(-edge.y, edge.x)) / dr.squared_norm(edge)
        walk.face = dr.select(crosses, face, walk.face)
        walk.shape = dr.select(crosses, shape, walk.shape)
        walk.point = dr.select(crosses, a + fraction * edge, walk.point)
        walk.direction = dr.select(crosses, unfolded, walk.direction)
        walk.left = dr.select(crosses, walk.left - way.distance, walk.left)
        walk.entered = dr.select(crosses, side, walk.entered)


def _corners(shape: Array3f64) -> tuple[Array2f64, Array2f64, Array2f64]:
    return Array2f64(0.0, 0.0), Array2f64(shape.x, 0.0), Array2f64(shape.y, shape.z)


def _side(shape: Array3f64, side: Int32) -> tuple[Array2f64, Array2f64]:
    """The ends of a side in the direction around the face."""
    a, b, c = _corners(shape)
    first = dr.select(side == 0, a, dr.select(side == 1, b, c))
    return first, dr.select(side == 0, b, dr.select(side == 1, c, a))


def _exit(walk: _Walk) -> _Exit:
    """The side ahead whose ends lie on either side of the ray.

    Elsewhere that is the side whose line is met first; but this also decides on faces of no area, where all
    three lines are one, and the exit stays on the side however the numbers are rounded.
    """
    corners = _corners(walk.shape)
    turns = [_cross(walk.direction, c - walk.point) for c in corners]  # > 0: to the left of the ray
    side, fraction, least = Int32(-1), Float64(0.0), Float64(dr.inf)
    for k in range(3):
        right, left, edge = turns[k], turns[(k + 1) % 3], corners[(k + 1) % 3] - corners[k]
        along, outward = dr.dot(walk.direction, edge), _cross(walk.direction, edge)
        offset = walk.point - corners[k]
        # Never the side that was entered, which rounding may put ahead of a ray along it.
        ahead = (outward > 0.0) & (walk.entered != k)
        met = _not_behind(-right / outward, offset, edge, along)
        miss = dr.maximum(right, 0.0) + dr.maximum(-left, 0.0)
        better = ahead & (miss < least)
        side = dr.select(better, Int32(k), side)
        fraction, least = dr.select(better, met, fraction), dr.select(better, miss, least)
    a, b = _side(walk.shape, side)
    point = a + fraction * (b - a)
    distance = dr.maximum(dr.dot(point - walk.point, walk.direction), 0.0)
    along, outward = dr.dot(walk.direction, b - a), _cross(walk.direction, b - a)
    return _Exit(side, fraction, point, distance, along, outward)


def _not_behind(fraction: Float64, offset: Array2f64, edge: Array2f64, along: Float64) -> Float64:
    """Keeps the crossing on the side and ahead of the ray, which it is up to rounding.

    Rounding is all that is left of it where the ray runs along the side: any point ahead will do then.

    Args:
        fraction: of the side, where its line is crossed.
        offset: the ray's point minus the start of the side.
        edge: the side.
        along: the ray's direction times `edge`.
    """
    here = dr.dot(offset, edge) / dr.squared_norm(edge)
    fraction = dr.select(along > 0.0, dr.maximum(fraction, here), dr.minimum(fraction, here))
    return dr.clip(fraction, 0.0, 1.0)


def _barycentric(shape: Array3f64, point: Array2f64) -> Array3f64:
    """Coordinates of points in a face, clamped to it; on its longest side where it has no area."""
    flat = shape.z == 0.0
    third = point.y / dr.select(flat, 1.0, shape.z)
    second = (point.x - third * shape.y) / dr.select(shape.x > 0.0, shape.x, 1.0)
    weights = Array3f64(1.0 - second - third, second, third)
    corners, longest = _corners(shape), Float64(0.0)
    for k in range(3):
        edge = corners[(k + 1) % 3] - corners[k]
        size = dr.squared_norm(edge)
        longer = flat & (size > longest)
        part = dr.dot(point - corners[k], edge) / dr.select(longer, size, 1.0)
        on_side = Array3f64(0.0)
        on_side[k], on_side[(k + 1) % 3] = 1.0 - part, part
        weights = dr.select(longer, on_side, weights)
        longest = dr.select(longer, size, longest)
    weights = dr.maximum(weights, 0.0)
    return weights / dr.sum(weights)


def _cross(a: Array2f64, b: Array2f64) -> Float64:
    return a.x * b.y - a.y * b.x


def _checked(
    face: ArrayLike, barycentric: ArrayLike, direction: ArrayLike, length: ArrayLike, faces: int
) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The arguments of `trace` as arrays that the device takes."""
    face = np.asarray(face)
    if face.ndim != 1 or not (np.issubdtype(face.dtype, np.integer) or not face.size):
        raise ConfigError(f"faces of shape {face.shape} and type {face.dtype}", "give (M,) integers")
    weights, direction = _numbers("barycentric", barycentric), _numbers("direction", direction)
    length = _numbers("length", length)
    for name, array in (("barycentric", weights), ("direction", direction)):
        if array.shape != (len(face), 3):
            raise ConfigError(f"{name} has shape {array.shape}", f"give one row per face, {(len(face), 3)}")
    if length.shape not in ((), face.shape):
        raise ConfigError(f"length has shape {length.shape}", f"give one number, or {len(face)}")
    if face.size and not 0 <= face.min() <= face.max() < faces:
        problem = f"faces from {face.min()} to {face.max()} of a mesh that has {faces}"
        raise ConfigError(problem, "use numbers from 0 on and below the count of faces")
    if length.size and length.min() < 0.0:
        raise ConfigError(
            f"the length {length.min()}", "use lengths of at least 0; turn the direction around"
        )
    if weights.size and (weights.min() < -TOLERANCE or np.abs(weights.sum(axis=1) - 1.0).max() > TOLERANCE):
        raise ConfigError("barycentric coordinates outside the face", "give three of at least 0, their sum 1")
    weights = np.maximum(weights, 0.0)
    weights /= weights.sum(axis=1, keepdims=True)
    length = np.ascontiguousarray(np.broadcast_to(length, face.shape))
    return np.ascontiguousarray(face, np.int32), weights, np.ascontiguousarray(direction), length


def _numbers(name: str, values: ArrayLike) -> np.ndarray:
    array = np.asarray(values, np.float64)
    if not np.isfinite(array).all():
        raise ConfigError(f"{name} has numbers that are NaN or infinite", "give finite ones")
    return array
