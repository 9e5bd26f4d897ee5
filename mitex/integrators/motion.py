"""`motion`: a Mitsuba integrator that renders how a vector field on the surface moves on the picture."""

from __future__ import annotations

from mitex.errors import ConfigError
from mitex.integrators.grid import (
    GridIntegrator,
    camera_ray,
    channels,
    check_shapes,
    film_positions,
    first_hits,
)
from mitex.runtime.jit import dr, mi
from mitex.textures.field import Field
from mitex.textures.variant import for_variant, option

STEP = 4e-3  # of the differences of rays, of the film: their errors are near 1e-5 then
CELL = 0.45  # of a sample's cell, at most, where a `batch` has views side by side


class MotionIntegrator(GridIntegrator):
    """Screen-space motion of the visible surface: H x W x 4 values, any sensor including `batch`.

    The channels are the motion to the right and downwards [pixels per unit time], the depth and the coverage:

    - A point of the surface moves with the field's vector, in world space [scene units per unit time]. The
      motion is the derivative of its place on the film, to 1e-4 of it (to 1e-3 in `batch` sensors of 2,048
      samples to a side); the field need not be tangent.
    - The depth is the distance along the camera's ray [scene units] from where the ray begins, as in
      Mitsuba's `depth` integrator: the near plane of perspective and orthographic sensors.
    - The coverage, in [0, 1], is the share of a pixel's samples that see a surface with vectors. Motion and
      depth are means over these samples, so that silhouettes are not slower, and 0 where there are none.

    .. pluginparameters::

     * - field
       - |texture|
       - The vectors, on every shape: a field of Mitex with 3 channels, such as a `vertex_field`, or any other
         texture, of which `eval_3` is read. (Default: the attribute)
       - exposed, differentiable
     * - attribute
       - |string|
       - Where there is no `field`: the name of the mesh attribute with the vectors, which
         `mesh.add_attribute("vertex_motion", 3, values)` adds. It is a parameter of the mesh. Shapes without
         one hide what is behind, and count as background. (Default: vertex_motion)
     * - antialias
       - |int|
       - n for n x n samples per pixel at the centres of a regular grid. An `spp` given to `mi.render`
         replaces it and must be a square number. (Default: 1)

    Variants: llvm and cuda ones. Others are a ConfigError.

    A thin lens is taken for a pinhole. An `instance` does not turn the vectors. The sensor's sampler and
    reconstruction filter are not used, and the result is not stored in the film, as in `feature`.

    The image is linear in the vectors. `mi.render` differentiates with respect to them, not to geometry or
    cameras.
    """

    plugin = "motion"

    def __init__(self, props: mi.Properties) -> None:
        self._read(props)
        self.attribute = option(props, "attribute", "vertex_motion")
        if self.field is not None and "attribute" in props:
            raise ConfigError("motion: both 'field' and 'attribute'", "give one of them")
        if not self.attribute.startswith(("vertex_", "face_")):
            raise ConfigError(
                f"motion: 'attribute' is '{self.attribute}'", "give a name that begins with vertex_ or face_"
            )

    def traverse(self, callback: mi.TraversalCallback) -> None:
        if self.field is not None:
            callback.put("field", self.field, mi.ParamFlags.Differentiable)

    def to_string(self) -> str:
        nested = str(self.field).replace("\n", "\n  ")
        source = f"field = {nested}" if self.field is not None else f"attribute = {self.attribute}"
        return f"MotionIntegrator[\n  {source},\n  antialias = {self.antialias}\n]"

    def fields(self, scene: mi.Scene) -> list[tuple[mi.Shape | None, mi.Texture]]:
        """The textures of the vectors, as (shape, texture) pairs; a shape of None stands for all shapes."""
        if self.field is not None:
            return [(None, self.field)]
        shapes = [shape for shape in scene.shapes() if dr.all(shape.has_attribute(self.attribute))]
        if not shapes:
            raise ConfigError(
                f"motion: no shape of the scene has an attribute '{self.attribute}'",
                f"add one with mesh.add_attribute('{self.attribute}', 3, values), or give a texture 'field'",
            )
        for shape in shapes:
            if isinstance(shape, mi.Mesh):
                _check_attribute(shape, self.attribute)
        texture = mi.load_dict({"type": "mesh_attribute", "name": self.attribute})
        return [(shape, texture) for shape in shapes]

    def _vectors(self, scene: mi.Scene, si: mi.SurfaceInteraction3f, covered: mi.Bool) -> mi.Vector3f:
        """What the field says at points, attached to its parameters."""
        texture = self.fields(scene)[0][1]
        if not isinstance(texture, Field):
            return mi.Vector3f(texture.eval_3(si, covered))
        check_shapes(texture, scene.shapes())
        values = channels(texture, si, covered)
        if len(values) != 3:
            raise ConfigError(f"motion: 'field' has {len(values)} channels", "give one of 3")
        return mi.Vector3f(*values)

    def _samples(self, scene: mi.Scene, camera: mi.Sensor, n: int) -> list[mi.Float]:
        position = film_positions(camera, n)
        with dr.suspend_grad():
            ray = camera_ray(camera, position)
            si = first_hits(scene, ray)
            right, down = _screen_axes(camera, position, n, ray, si.t)
            covered = si.is_valid()
            if self.field is None:
                covered &= si.shape.has_attribute(self.attribute, covered)
        vector = self._vectors(scene, si, covered)
        with dr.suspend_grad():
            count = dr.select(covered, mi.Float(1), 0)
            share = count if n == 1 else dr.repeat(dr.block_sum(count, n * n), n * n) / (n * n)
            weight = dr.select(covered, 1 / share, 0)
        values = (dr.dot(vector, right), dr.dot(vector, down), si.t)
        return [*(dr.select(covered, value * weight, 0) for value in values), count]


def _check_attribute(shape: mi.Mesh, name: str) -> None:
    count = shape.vertex_count() if name.startswith("vertex_") else shape.face_count()
    size = dr.width(shape.attribute_buffer(name)) // count
    if size != 3:
        raise ConfigError(
            f"motion: the attribute '{name}' of mesh '{shape.id()}' has {size} numbers each", "give it 3"
        )


def _screen_axes(
    camera: mi.Sensor, position: mi.Point2f, n: int, ray: mi.Ray3f, distance: mi.Float
) -> tuple[mi.Vector3f, mi.Vector3f]:
    """Vectors whose scalar products with a velocity are its motion to the right and downwards [pixels].

    A step of a pixels to the right and b downwards moves the point at the same distance on the ray by
    a R + b D. The surface's point moves by the velocity U, and how far it is on its new ray does not matter:
    U = a R + b D + c d with the ray's direction d, which Cramer's rule solves for a and b.
    """
    right, down = (_slope(camera, position, n, axis, distance) for axis in range(2))
    across_right, across_down = dr.cross(down, ray.d), dr.cross(ray.d, right)
    determinant = dr.dot(right, across_right)
    return across_right / determinant, across_down / determinant


def _slope(camera: mi.Sensor, position: mi.Point2f, n: int, axis: int, distance: mi.Float) -> mi.Vector3f:
    """Derivative of points at a distance on the rays along an axis of the film [scene units per pixel].

    By central differences, since Dr.Jit cannot differentiate the `batch` sensor. Of that one, steps stay
    within a sample's cell, so that they end in the same view; on a large film their errors are larger.
    """
    size = camera.film().crop_size()[axis]
    step = mi.Vector2f(0)
    step[axis] = min(STEP, CELL / (n * size)) if camera.class_name() == "BatchSensor" else STEP
    after, before = (mi.Point2f(mi.Vector2f(position) + sign * step) for sign in (1, -1))
    end, start = (camera_ray(camera, place)(distance) for place in (after, before))
    return mi.Vector3f(end - start) / ((after[axis] - before[axis]) * size)


def register() -> None:
    """Registers the integrator for the current variant."""
    cls = for_variant(mi.CppADIntegrator, MotionIntegrator)
    mi.register_integrator("motion", lambda props: cls(props))
