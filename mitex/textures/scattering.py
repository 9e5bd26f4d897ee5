"""Where rays are scattered in a field that reflects the light of its surroundings."""

from __future__ import annotations

import math
from typing import Protocol, runtime_checkable

from mitex.runtime.jit import dr, mi
from mitex.textures.march import (
    OPAQUE,
    WINDOW,
    RadianceField,
    Samples,
    march,
    scene_box,
    sum_before,
    sum_rays,
)
from mitex.textures.phong import Phong

NONE = 0xFFFFFFFF  # the index of no sample


@runtime_checkable
class ReflectingField(RadianceField, Protocol):
    """A field that can be lit: its matter has a reflection apart from the light that it was captured in."""

    def extinction(self, points: mi.Point3f) -> tuple[mi.UInt32, mi.Float]:
        """Of N points: ascending indices of those that have matter (M,), their density [1 / scene units]."""
        ...

    def reflection(self, points: mi.Point3f, view: mi.Vector3f) -> tuple[mi.UInt32, Phong]:
        """Of N points seen along unit directions: ascending indices (M,) of those that have matter, and what
        these reflect."""
        ...


def first_event(
    field: ReflectingField,
    origin: mi.Point3f,
    direction: mi.Vector3f,
    jitter: mi.Float,
    threshold: mi.Float,
    far: mi.Float | float = math.inf,
) -> mi.Float:
    """How far rays come until their transmittance falls below a threshold.

    With a threshold that is uniform in [0, 1) a ray ends at each place with the probability that the matter
    there scatters it first: the weights of compositing, of which one is drawn.

    Args:
        field: what is marched through.
        origin, direction, jitter: R rays as of `march`.
        threshold: (R,) in [0, 1).
        far: where they end, a number or (R,) [scene units].

    Returns:
        (R,) distances; infinite where a ray passes.
    """
    distance = dr.full(mi.Float, dr.inf, dr.width(origin))
    # Rays that are nearly opaque have come to an end, as in `composite`.
    least = dr.maximum(threshold, OPAQUE)
    near, leave = scene_box(origin, direction)
    leave = dr.minimum(leave, far)
    alive = mi.UInt32(dr.compress(near < leave))
    window = dr.opaque(mi.Float, WINDOW * field.step)
    while dr.width(alive):
        o, d = dr.gather(mi.Point3f, origin, alive), dr.gather(mi.Vector3f, direction, alive)
        j, first, last, rest = (dr.gather(mi.Float, v, alive) for v in (jitter, near, leave, least))
        end = first + window
        samples = march(o, d, field.mask, field.step, j, first, dr.minimum(last, end))
        event, transmittance = _first_of(field, samples, o, d, rest)
        dr.scatter(distance, event, alive)
        dr.scatter(least, rest / transmittance, alive)
        dr.scatter(near, end, alive)
        alive = dr.gather(mi.UInt32, alive, mi.UInt32(dr.compress((event == dr.inf) & (end < last))))
    return distance


def _first_of(
    field: ReflectingField, samples: Samples, origin: mi.Point3f, direction: mi.Vector3f, least: mi.Float
) -> tuple[mi.Float, mi.Float]:
    """As of `first_event` for the samples of R rays, and the transmittance of all of them (R,)."""
    distance, transmittance = dr.full(mi.Float, dr.inf, samples.rays), dr.ones(mi.Float, samples.rays)
    if not len(samples):
        return distance, transmittance
    index, density = field.extinction(samples.points(origin, direction))
    if not dr.width(index):
        return distance, transmittance
    samples = samples.subset(index)
    depth = mi.Float64(density * samples.length)
    behind = mi.Float(dr.exp(-sum_before(depth, samples) - depth))
    # The samples are in the order of their rays, and ascend along each.
    ends = mi.UInt32(dr.compress(behind < dr.gather(mi.Float, least, samples.ray)))
    first = dr.full(mi.UInt32, NONE, samples.rays)
    dr.scatter_reduce(dr.ReduceOp.Min, first, ends, dr.gather(mi.UInt32, samples.ray, ends))
    distance = dr.select(first == NONE, dr.inf, dr.gather(mi.Float, samples.t, first, first != NONE))
    return distance, mi.Float(dr.exp(-sum_rays(depth, samples)))
