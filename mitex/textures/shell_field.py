"""`shell_field`: a volume that carries a radiance field, for the `shell` integrator.

Mitsuba 3.9 registers no Python volumes, so a `shell_field` is not named in a scene's dictionary: it is made
by `shell_field(...)` and given to the integrator as an object. The parameters of a `DifferentiableField`
are then those of the scene: `mi.traverse` lists them, and images have derivatives to them.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from mitex.mesh import Similarity
from mitex.runtime.jit import dr, mi
from mitex.textures.march import Composite, DifferentiableField, RadianceField, composite
from mitex.textures.variant import for_variant, init_base, require_variant

CHUNK = 1 << 16  # rays that are marched at a time


class ShellField:
    """A radiance field somewhere in the world, for the integrator `shell`.

    `shell_field(field, similarity, turn)` makes one; a scene's dictionary cannot.

    .. pluginparameters::

     * - field
       - |object|
       - A `mitex.textures.march.RadianceField`, in its own cube [-1, 1]^3. The parameters of a
         `DifferentiableField` become parameters of the scene, under the names that it gives them.
       - exposed, differentiable
     * - similarity
       - |object|
       - Where it is: a `mitex.mesh.Similarity`, world -> cube.
     * - turn
       - |array|
       - Rotation of the field in the world about the origin, (3, 3). (Default: none)

    Variants: llvm_ad_rgb and cuda_ad_rgb. Others are a ConfigError.
    """

    def __init__(self, field: RadianceField, similarity: Similarity, turn: np.ndarray | None = None) -> None:
        init_base(mi.Volume, self, mi.Properties("shell_field"))
        self.field, self.similarity = field, similarity
        self.turn = np.eye(3) if turn is None else turn

    def bbox(self) -> mi.ScalarBoundingBox3f:
        """Of the cube, in the world."""
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        corners = (corners * self.similarity.scale + self.similarity.center) @ self.turn.T
        return mi.ScalarBoundingBox3f(corners.min(0).tolist(), corners.max(0).tolist())

    def max_value(self) -> float:
        """No bound is known."""
        return float("inf")

    def march(self, ray: mi.Ray3f, jitter: mi.Float, active: mi.Bool) -> Composite:
        """What rays gather up to their `maxt`, where `active`: as of `composite`, with depths in world
        units.

        Args:
            ray: R rays with unit directions.
            jitter: (R,) in [0, 1), see `march`.
            active: which rays are marched, one value for each or for all; what is not marched passes freely.
        """
        scale = float(self.similarity.scale)
        centre = mi.Vector3f(np.asarray(self.similarity.center, np.float32).tolist())
        count = max(dr.width(ray.o), dr.width(active), dr.width(jitter))
        rays = mi.UInt32(dr.compress(active & dr.full(mi.Bool, True, count)))
        total = Composite(dr.zeros(mi.Color3f, count), dr.ones(mi.Float, count), dr.zeros(mi.Float, count))
        for start in range(0, dr.width(rays), CHUNK):
            part = dr.arange(mi.UInt32, start, min(start + CHUNK, dr.width(rays)))
            index = dr.gather(mi.UInt32, rays, part)
            # Anew for each part: a zero in it can become as wide as what it was multiplied with.
            back = mi.Matrix3f(self.turn.T.tolist())
            origin = mi.Point3f((back @ dr.gather(mi.Point3f, ray.o, index) - centre) / scale)
            direction = mi.Vector3f(back @ dr.gather(mi.Vector3f, ray.d, index))
            far = dr.gather(mi.Float, ray.maxt, index) / scale
            pixels = composite(self.field, origin, direction, dr.gather(mi.Float, jitter, index), far)
            dr.scatter(total.colour, pixels.colour, index)
            dr.scatter(total.transmittance, pixels.transmittance, index)
            dr.scatter(total.depth, pixels.depth * scale, index)
        return total

    def traverse(self, callback: mi.TraversalCallback) -> None:
        if isinstance(self.field, DifferentiableField):
            for name, value in self.field.parameters().items():
                callback.put(name, value, mi.ParamFlags.Differentiable)

    def parameters_changed(self, keys: Sequence[str] = ()) -> None:
        if isinstance(self.field, DifferentiableField):
            self.field.parameters_changed()

    def to_string(self) -> str:
        return f"ShellField[\n  bbox = {self.bbox()},\n  step = {self.field.step}\n]"


def shell_field(field: RadianceField, similarity: Similarity, turn: np.ndarray | None = None) -> mi.Volume:
    """An `mi.Volume` of the current variant that carries a radiance field; see `ShellField`."""
    require_variant("shell_field", works_in_variant(), "llvm_ad_rgb or cuda_ad_rgb")
    return for_variant(mi.Volume, ShellField)(field, similarity, turn)


def works_in_variant() -> bool:
    """Whether the current variant can march through fields, whose colours are red, green and blue."""
    return dr.is_jit_v(mi.Float) and not (mi.is_spectral or mi.is_monochromatic or mi.is_polarized)
