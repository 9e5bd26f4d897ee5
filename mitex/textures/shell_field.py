"""`shell_field`: a volume that carries a radiance field, for the `shell` integrator.

Mitsuba 3.9 registers no Python volumes, so a `shell_field` is not named in a scene's dictionary: it is made
by `shell_field(...)` and given to the integrator as an object. That keeps the field's arrays as they are; as
the integrator's parameters they would have to be named and copied one by one.
"""

from __future__ import annotations

from typing import Any

import numpy as np

from mitex.integrators.march import RadianceField, Traversed, traverse
from mitex.mesh import Similarity
from mitex.runtime import load_mitsuba
from mitex.textures.variant import for_variant

mi: Any = load_mitsuba(needs_llvm=False)
import drjit as dr  # noqa: E402  (Mitsuba first: it decides which LLVM Dr.Jit opens)

CHUNK = 1 << 16  # rays that are marched at a time


class ShellFieldMethods:
    """A radiance field somewhere in the world.

    Args:
        field: in its own cube [-1, 1]^3.
        similarity: world -> cube.
    """

    def __init__(self, field: RadianceField, similarity: Similarity) -> None:
        mi.Volume.__init__(self, mi.Properties("shell_field"))
        self.field, self.similarity = field, similarity

    def bbox(self) -> Any:
        """Of the cube, in the world."""
        centre, half = self.similarity.center, self.similarity.scale
        return mi.ScalarBoundingBox3f((centre - half).tolist(), (centre + half).tolist())

    def max_value(self) -> float:
        """No bound is known."""
        return float("inf")

    def march(self, ray: Any, jitter: Any, active: Any) -> Traversed:
        """What rays gather up to their `maxt`, where `active`; colours and depths as in `traverse`, but in
        world units.

        Args:
            ray: `mi.Ray3f` with unit directions.
            jitter: in [0, 1) for each.
            active: which rays count; the others gather nothing.
        """
        scale = float(self.similarity.scale)
        centre = mi.Vector3f(np.asarray(self.similarity.center, np.float32).tolist())
        chosen: Any = dr.compress(active)
        count = max(dr.width(ray.o), dr.width(active), dr.width(jitter))
        total = Traversed(dr.zeros(mi.Color3f, count), dr.ones(mi.Float, count), dr.zeros(mi.Float, count))
        for start in range(0, dr.width(chosen), CHUNK):
            part = dr.arange(mi.UInt32, start, min(start + CHUNK, dr.width(chosen)))
            index = dr.gather(mi.UInt32, chosen, part)
            origin = mi.Point3f((dr.gather(mi.Point3f, ray.o, index) - centre) / scale)
            direction = dr.gather(mi.Vector3f, ray.d, index)
            far = dr.gather(mi.Float, ray.maxt, index) / scale
            found = traverse(self.field, origin, direction, dr.gather(mi.Float, jitter, index), far)
            dr.scatter(total.colour, found.colour, index)
            dr.scatter(total.through, found.through, index)
            dr.scatter(total.depth, found.depth * scale, index)
        return total

    def traverse(self, callback: Any) -> None:
        parameters = getattr(self.field, "parameters", None)
        for name, value in (parameters() if parameters else {}).items():
            callback.put(name, value, mi.ParamFlags.Differentiable)

    def to_string(self) -> str:
        return f"ShellField[\n  bbox = {self.bbox()},\n  step = {self.field.step}\n]"


def shell_field(field: RadianceField, similarity: Similarity) -> Any:
    """An `mi.Volume` of the current variant that carries a radiance field; see `ShellFieldMethods`."""
    return for_variant("ShellField", mi.Volume, ShellFieldMethods)(field, similarity)
