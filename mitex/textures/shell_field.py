"""`shell_field`: a volume that carries a radiance field, for the `shell` integrator.

Mitsuba 3.9 registers no Python volumes, so a `shell_field` is not named in a scene's dictionary: it is made
by `shell_field(...)` and given to the integrator as an object. The parameters of a `DifferentiableField`
are then those of the scene: `mi.traverse` lists them, and images have derivatives to them.
"""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from typing import Any

import numpy as np

from mitex.mesh import Similarity
from mitex.runtime.jit import dr, mi
from mitex.textures.march import Composite, DifferentiableField, RadianceField, composite
from mitex.textures.phong import Phong
from mitex.textures.scattering import first_event
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
        self.field: Any = field
        self.similarity = similarity
        self.turn = np.eye(3) if turn is None else turn

    def bbox(self) -> mi.ScalarBoundingBox3f:
        """Of the cube, in the world."""
        corners = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)])
        corners = (corners * self.similarity.scale + self.similarity.centre) @ self.turn.T
        return mi.ScalarBoundingBox3f(corners.min(0).tolist(), corners.max(0).tolist())

    def max_value(self) -> float:
        """No bound is known."""
        return float("inf")

    @property
    def _scale(self) -> mi.Float:
        """World units of a unit of the cube; opaque as all that says where the field is, so that fields in
        many places share kernels."""
        return dr.opaque(mi.Float, float(self.similarity.scale))

    @property
    def world_step(self) -> float:
        """Of rays through the field [world units]."""
        return self.field.step * float(self.similarity.scale)

    def march(self, ray: mi.Ray3f, jitter: mi.Float, active: mi.Bool) -> Composite:
        """What rays gather up to their `maxt`, where `active`: as of `composite`, with depths in world
        units.

        Args:
            ray: R rays with unit directions.
            jitter: (R,) in [0, 1), see `march`.
            active: which rays are marched, one value for each or for all; what is not marched passes freely.
        """
        scale = self._scale
        count = max(dr.width(ray.o), dr.width(active), dr.width(jitter))
        total = Composite(dr.zeros(mi.Color3f, count), dr.ones(mi.Float, count), dr.zeros(mi.Float, count))
        dr.schedule(jitter)
        for index, origin, direction, far in self._parts(ray, active, count):
            pixels = composite(self.field, origin, direction, dr.gather(mi.Float, jitter, index), far)
            dr.scatter(total.colour, pixels.colour, index)
            dr.scatter(total.transmittance, pixels.transmittance, index)
            dr.scatter(total.depth, pixels.depth * scale, index)
        return total

    def flight(self, ray: mi.Ray3f, jitter: mi.Float, threshold: mi.Float, active: mi.Bool) -> mi.Float:
        """How far rays come before they are scattered, up to their `maxt`.

        Args:
            ray, jitter, active: as of `march`. The field is a `ReflectingField`.
            threshold: (R,) in [0, 1), see `first_event`.

        Returns:
            (R,) in world units; infinite where a ray passes or is not active.
        """
        count = max(dr.width(ray.o), dr.width(active), dr.width(jitter))
        distance = dr.full(mi.Float, dr.inf, count)
        dr.schedule(jitter, threshold)
        for index, origin, direction, far in self._parts(ray, active, count):
            j, least = dr.gather(mi.Float, jitter, index), dr.gather(mi.Float, threshold, index)
            event = first_event(self.field, origin, direction, j, least, far)
            dr.scatter(distance, event * self._scale, index)
        return distance

    def reflection(self, points: mi.Point3f, view: mi.Vector3f, active: mi.Bool) -> tuple[mi.Bool, Phong]:
        """What N points in the world reflect, seen along unit directions.

        Returns:
            Which have matter and are active (N,), and their reflection with normals in the world; zeros for
            the others.
        """
        count = dr.width(points)
        solid = dr.zeros(mi.Bool, count)
        total = Phong(
            dr.zeros(mi.Vector3f, count),
            dr.zeros(mi.Color3f, count),
            dr.zeros(mi.Float, count),
            dr.zeros(mi.Float, count),
        )
        rays = mi.Ray3f(points, view)
        for index, place, direction, _ in self._parts(rays, active, count):
            part, phong = self.field.reflection(place, direction)
            index = dr.gather(mi.UInt32, index, part)
            phong.normal = mi.Vector3f(_opaque(self.turn) @ phong.normal)
            dr.scatter(solid, True, index)
            for name, values in vars(total).items():
                dr.scatter(values, getattr(phong, name), index)
        return solid, total

    def _parts(
        self, ray: mi.Ray3f, active: mi.Bool, count: int
    ) -> Iterator[tuple[mi.UInt32, mi.Point3f, mi.Vector3f, mi.Float]]:
        """Indices of active rays, at most `CHUNK` at a time, and the rays in the field's cube: their origins,
        directions and ends."""
        scale, centre = self._scale, dr.opaque(mi.Vector3f, self.similarity.centre.tolist())
        dr.eval(ray, active)  # at once, or each array that is gathered from would be computed alone
        rays = mi.UInt32(dr.compress(active & dr.full(mi.Bool, True, count)))
        for start in range(0, dr.width(rays), CHUNK):
            size = min(CHUNK, dr.width(rays) - start)
            part = dr.arange(mi.UInt32, size) + dr.opaque(mi.UInt32, start)
            index = dr.gather(mi.UInt32, rays, part)
            back = _opaque(self.turn.T)
            origin = mi.Point3f((back @ dr.gather(mi.Point3f, ray.o, index) - centre) / scale)
            direction = mi.Vector3f(back @ dr.gather(mi.Vector3f, ray.d, index))
            yield index, origin, direction, dr.gather(mi.Float, ray.maxt, index) / scale

    def traverse(self, callback: mi.TraversalCallback) -> None:
        if isinstance(self.field, DifferentiableField):
            for name, value in self.field.parameters().items():
                callback.put(name, value, mi.ParamFlags.Differentiable)

    def parameters_changed(self, keys: Sequence[str] = ()) -> None:
        if isinstance(self.field, DifferentiableField):
            self.field.parameters_changed()

    def to_string(self) -> str:
        return f"ShellField[\n  bbox = {self.bbox()},\n  step = {self.field.step}\n]"


def _opaque(matrix: np.ndarray) -> mi.Matrix3f:
    return dr.opaque(mi.Matrix3f, matrix.tolist())


def shell_field(field: RadianceField, similarity: Similarity, turn: np.ndarray | None = None) -> mi.Volume:
    """An `mi.Volume` of the current variant that carries a radiance field; see `ShellField`."""
    require_variant("shell_field", works_in_variant(), "llvm_ad_rgb or cuda_ad_rgb")
    return for_variant(mi.Volume, ShellField)(field, similarity, turn)


def works_in_variant() -> bool:
    """Whether the current variant can march through fields, whose colours are red, green and blue."""
    return dr.is_jit_v(mi.Float) and not (mi.is_spectral or mi.is_monochromatic or mi.is_polarized)
