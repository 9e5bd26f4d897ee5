"""Marching rays through occupied cells of the scene cube, and what they gather (all in Dr.Jit).

Lengths of steps and sides of grids are opaque, `dr.opaque`: as literals, each would ask for kernels of its
own.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Protocol, TypeVar, runtime_checkable

from mitex.runtime.jit import dr, mi

A = TypeVar("A", bound=dr.ArrayBase)

DIAGONAL = 2 * math.sqrt(3)  # of the scene cube [-1, 1]^3
WINDOW = 48  # steps that are taken before the rays that have come to an end are dropped
OPAQUE = 1e-3  # transmittance of a ray that has come to an end
FRONT = 16  # samples of a ray that are evaluated first, then as many again, and twice as many each time


@dataclass
class Samples:
    """M places on R rays, ordered by ray and then by distance.

    Attributes:
        ray: (M,) `mi.UInt32`, which ray.
        t: (M,) `mi.Float` distance along it [scene units].
        step: what each of them stands for [scene units].
        rays: R.
    """

    ray: mi.UInt32
    t: mi.Float
    step: float
    rays: int

    def __len__(self) -> int:
        return dr.width(self.ray) if self.rays else 0

    @property
    def length(self) -> mi.Float:
        """The same as `step`, opaque."""
        return dr.opaque(mi.Float, self.step)

    def subset(self, index: mi.UInt32) -> Samples:
        """The samples at ascending indices."""
        ray, t = dr.gather(mi.UInt32, self.ray, index), dr.gather(mi.Float, self.t, index)
        return Samples(ray, t, self.step, self.rays)

    def points(self, origin: mi.Point3f, direction: mi.Vector3f) -> mi.Point3f:
        """(M,) `mi.Point3f` on rays of R origins and directions."""
        along = dr.gather(mi.Vector3f, direction, self.ray)
        return dr.gather(mi.Point3f, origin, self.ray) + mi.Point3f(along * self.t)


class RadianceField(Protocol):
    """What can be marched through.

    Attributes:
        mask: (G, G, G) `mi.TensorXu8` of 0 and 1, the occupied cells of [-1, 1]^3, x slowest.
        step: between samples [scene units].
    """

    mask: mi.TensorXu8
    step: float

    def evaluate(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, mi.Float, mi.Color3f]:
        """Of N points, and the unit directions in which they are seen: ascending indices of those that have
        matter (M,), their density [1 / scene units] and colour `mi.Color3f`."""
        ...


@runtime_checkable
class DifferentiableField(RadianceField, Protocol):
    """A field with parameters that scenes list and change, and that images are differentiable in."""

    def parameters(self) -> Mapping[str, dr.ArrayBase]:
        """Dr.Jit arrays by name, the same objects with each call: they are changed in place."""
        ...

    def parameters_changed(self) -> None:
        """Takes over new values; ConfigError if they cannot be used."""
        ...


@dataclass
class Composite:
    """Light along R rays, composited from the front.

    Attributes:
        colour: `mi.Color3f` display values, times opacity.
        transmittance: what passes the whole ray, `mi.Float` in [0, 1].
        depth: mean distance of the matter, times opacity, `mi.Float` [scene units].
    """

    colour: mi.Color3f
    transmittance: mi.Float
    depth: mi.Float


def composite(
    field: RadianceField,
    origin: mi.Point3f,
    direction: mi.Vector3f,
    jitter: mi.Float,
    far: mi.Float | float = math.inf,
) -> Composite:
    """Marches through a field from the front, until the rays are opaque.

    Args:
        field: what is marched through; derivatives to its parameters are kept if AD is on.
        origin, direction, jitter: R rays as in `march`.
        far: where they end, a number or (R,) [scene units].
    """
    count = dr.width(origin)
    result = Composite(dr.zeros(mi.Color3f, count), dr.ones(mi.Float, count), dr.zeros(mi.Float, count))
    near, leave = scene_box(origin, direction)
    leave = dr.minimum(leave, far)
    alive = mi.UInt32(dr.compress(near < leave))
    window = dr.opaque(mi.Float, WINDOW * field.step)
    while dr.width(alive):
        o, d = dr.gather(mi.Point3f, origin, alive), dr.gather(mi.Vector3f, direction, alive)
        j, first, last = (dr.gather(mi.Float, v, alive) for v in (jitter, near, leave))
        end = first + window
        samples = march(o, d, field.mask, field.step, j, first, dr.minimum(last, end))
        if len(samples):
            _gather(field, samples, o, d, alive, result)
        dr.scatter(near, end, alive)
        transmittance = dr.gather(mi.Float, dr.detach(result.transmittance), alive)
        unfinished = mi.UInt32(dr.compress((transmittance > OPAQUE) & (end < last)))
        alive = dr.gather(mi.UInt32, alive, unfinished)
    return result


def _gather(
    field: RadianceField,
    samples: Samples,
    origin: mi.Point3f,
    direction: mi.Vector3f,
    rays: mi.UInt32,
    to: Composite,
) -> None:
    """Adds one window's samples to the results of the `rays` that they lie on."""
    along = dr.gather(mi.Vector3f, direction, samples.ray)
    index, density, colour = field.evaluate(samples.points(origin, direction), along)
    if not dr.width(index):
        return
    dr.eval(density, colour)
    samples = samples.subset(index)
    weights, transmittance = weights_of(density, samples)
    before = dr.gather(mi.Float, to.transmittance, rays)
    weights *= dr.gather(mi.Float, before, samples.ray)
    ray = dr.gather(mi.UInt32, rays, samples.ray)
    dr.scatter_add(to.colour, colour * weights, ray)
    dr.scatter_add(to.depth, dr.detach(samples.t * weights), ray)
    dr.scatter(to.transmittance, before * transmittance, rays)
    dr.eval(to.colour, to.depth, to.transmittance)


def march(
    origin: mi.Point3f,
    direction: mi.Vector3f,
    grid: mi.TensorXu8,
    step: float,
    jitter: mi.Float,
    near: mi.Float | float = 0.0,
    far: mi.Float | float = math.inf,
) -> Samples:
    """Samples at even steps, where the ray is in an occupied cell.

    Args:
        origin, direction: R rays, `mi.Point3f` and unit `mi.Vector3f` [scene units].
        grid: (G, G, G) `mi.TensorXu8` of 0 and 1, the occupied cells of [-1, 1]^3, x slowest.
        step: between samples [scene units].
        jitter: (R,) in [0, 1): where in its first step a ray begins.
        near, far: the part of the rays that counts, numbers or (R,) [scene units].
    """
    count, side = dr.width(origin), grid.shape[0]
    enter, leave = scene_box(origin, direction)
    enter, leave = dr.maximum(enter, near), dr.minimum(leave, far)
    longest = dr.max(leave - enter)[0] if count else 0.0
    if not longest > 0:
        return Samples(mi.UInt32(), mi.Float(), step, count)
    steps = math.ceil(longest / step) + 1
    index, width = dr.arange(mi.UInt32, count * steps), dr.opaque(mi.UInt32, steps)
    ray = index // width
    within = mi.Float(index - ray * width) + dr.gather(mi.Float, jitter, ray)
    t = dr.gather(mi.Float, enter, ray) + within * dr.opaque(mi.Float, step)
    before_exit = t < dr.gather(mi.Float, leave, ray)
    candidates = Samples(ray, t, step, count)
    cell = cells_of(candidates.points(origin, direction), side)
    occupied = dr.compress(before_exit & (dr.gather(mi.UInt8, grid.array, cell, before_exit) != 0))
    return candidates.subset(mi.UInt32(occupied))


def visible(
    samples: Samples,
    origin: mi.Point3f,
    direction: mi.Vector3f,
    density: Callable[[mi.Point3f], mi.Float],
) -> Samples:
    """The samples that are seen: those before which the ray has not come to an end.

    In an opaque scene these are few, and only they are worth colours and derivatives.

    Args:
        samples: of R rays.
        origin, direction: of the rays.
        density: of points `mi.Point3f`, `mi.Float` without derivatives [1 / scene units].
    """
    depth = dr.zeros(mi.Float, len(samples))
    rank = dr.arange(mi.UInt32, len(samples)) - _first(samples)
    dr.eval(rank)
    end, part = FRONT, rank < dr.opaque(mi.UInt32, FRONT)
    while dr.width(index := mi.UInt32(dr.compress(part))):
        points = samples.subset(index).points(origin, direction)
        dr.scatter(depth, density(points) * samples.length, index)
        transmittance = dr.gather(mi.Float, dr.exp(-sum_rays(depth, samples)), samples.ray)
        first, end = end, 2 * end
        part = (rank >= dr.opaque(mi.UInt32, first)) & (rank < dr.opaque(mi.UInt32, end))
        part &= transmittance > OPAQUE
    before = sum_before(mi.Float64(depth), samples)
    return samples.subset(mi.UInt32(dr.compress(dr.exp(-before) > OPAQUE)))


def cells_of(points: mi.Point3f, side: int) -> mi.UInt32:
    """Index of the cell of the scene cube, x slowest, for `mi.Point3f` inside."""
    half, last = dr.opaque(mi.Float, 0.5 * side), dr.opaque(mi.Float, side - 1)
    x, y, z = (mi.UInt32(dr.clip((p + 1) * half, 0, last)) for p in points)
    count = dr.opaque(mi.UInt32, side)
    return (x * count + y) * count + z


def weights_of(density: mi.Float, samples: Samples) -> tuple[mi.Float, mi.Float]:
    """Compositing weight of each sample (M,), and transmittance of each ray (R,).

    Args:
        density: (M,) [1 / scene units], attached or not.
        samples: their places.
    """
    depth = mi.Float64(density * samples.length)
    weights = dr.exp(-dr.custom(_Before, depth, samples)) * (1 - dr.exp(-depth))
    return mi.Float(weights), mi.Float(dr.exp(-sum_rays(depth, samples)))


class _Before(dr.CustomOp):
    """For each sample the sum over those before it on its ray, `mi.Float64`.

    Its own derivative: that of Dr.Jit's prefix sum needs a new kernel for each M.
    """

    def eval(self, values: mi.Float64, samples: Samples) -> mi.Float64:
        self.samples = samples
        return sum_before(values, samples)

    def forward(self) -> None:
        self.set_grad_out(sum_before(mi.Float64(self.grad_in("values")), self.samples))

    def backward(self) -> None:
        grad = mi.Float64(self.grad_out())
        total = dr.gather(mi.Float64, sum_rays(grad, self.samples), self.samples.ray)
        self.set_grad_in("values", total - sum_before(grad, self.samples) - grad)


def sum_before(values: mi.Float64, samples: Samples) -> mi.Float64:
    """For each sample (M,) the sum of `values` over those before it on its ray."""
    # In double precision: the sum runs over all rays, and differences of it must keep their digits.
    sums = dr.prefix_sum(values)
    return sums - dr.gather(mi.Float64, sums, _first(samples))


def _first(samples: Samples) -> mi.UInt32:
    """Index of the first sample of each sample's ray."""
    index = dr.arange(mi.UInt32, len(samples))
    start = dr.full(mi.UInt32, 0xFFFFFFFF, samples.rays)
    dr.scatter_reduce(dr.ReduceOp.Min, start, index, samples.ray)
    return dr.gather(mi.UInt32, start, samples.ray)


def sum_rays(values: A, samples: Samples) -> A:
    """Sums over each ray (R,) of values (M,), `mi.Float` or an array of them."""
    total = dr.zeros(type(values), samples.rays)
    dr.scatter_add(total, values, samples.ray)
    return total


def scene_box(origin: mi.Point3f, direction: mi.Vector3f) -> tuple[mi.Float, mi.Float]:
    """Where rays (R,) enter and leave the scene cube; the entry is behind the exit where they miss it."""
    inverse = 1 / dr.select(direction == 0, 1e-12, direction)
    start = mi.Vector3f(origin)
    a, b = (-1 - start) * inverse, (1 - start) * inverse
    return dr.maximum(dr.max(dr.minimum(a, b)), 0), dr.min(dr.maximum(a, b))
