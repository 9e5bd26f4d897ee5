"""What `feature` and `motion` share: images of values at the centres of a regular grid in every pixel."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from mitex.errors import ConfigError
from mitex.runtime.jit import dr, mi
from mitex.textures.field import Field
from mitex.textures.variant import init_base, option, require_variant


class GridIntegrator:
    """Members of the plugin class of such an integrator; a subclass adds `_samples`.

    The image is deterministic: no sampler, no reconstruction filter but the box. It is returned and not
    stored in the film, which has no room for C channels.
    """

    plugin: str  # type of the plugin, for messages

    def _read(self, props: mi.Properties) -> None:
        """Reads the properties that all of them have."""
        init_base(mi.CppADIntegrator, self, props)
        require_variant(self.plugin, dr.is_jit_v(mi.Float), "an llvm or cuda one")
        field = props.get("field")
        if field is not None and not isinstance(field, mi.Texture):
            raise ConfigError(f"{self.plugin}: 'field' is a {type(field).__name__}", "give a texture")
        self.field = field
        self.antialias = option(props, "antialias", 1)
        if self.antialias < 1:
            raise ConfigError(f"{self.plugin}: 'antialias' is {self.antialias}", "use 1 or more")

    def aov_names(self) -> list[str]:
        return []

    def render(
        self,
        scene: mi.Scene,
        sensor: mi.Sensor | int = 0,
        seed: mi.UInt32 | int = 0,
        spp: int = 0,
        develop: bool = True,
        evaluate: bool = True,
    ) -> mi.TensorXf:
        """The image, `mi.TensorXf` (H, W, C); attached where parameters and the AD mode are."""
        if not develop:
            raise ConfigError(f"{self.plugin}: the film holds no result", "render with develop=True")
        image = self._image(scene, sensor, spp)
        if evaluate:
            dr.eval(image)
        return image

    def render_forward(
        self,
        scene: mi.Scene,
        params: Any,
        sensor: mi.Sensor | int = 0,
        seed: mi.UInt32 | int = 0,
        spp: int = 0,
    ) -> mi.TensorXf:
        """Derivative of the image along the gradients set on the parameters."""
        with dr.resume_grad():
            image = self._image(scene, sensor, spp)
            dr.forward_to(image)
            return dr.grad(image)

    def render_backward(
        self,
        scene: mi.Scene,
        params: Any,
        grad_in: mi.TensorXf,
        sensor: mi.Sensor | int = 0,
        seed: mi.UInt32 | int = 0,
        spp: int = 0,
    ) -> None:
        """Adds the gradient of the parameters for the image's gradient `grad_in` (H, W, C)."""
        n = self._side(spp)
        with dr.resume_grad():
            values = self._samples(scene, sensor_of(scene, sensor), n)
        pixel = dr.arange(mi.UInt32, dr.width(values[0])) // (n * n)
        adjoint = dr.detach(grad_in.array) / (n * n)
        for channel, value in enumerate(values):
            if dr.grad_enabled(value):
                dr.set_grad(value, dr.gather(mi.Float, adjoint, len(values) * pixel + channel))
                dr.enqueue(dr.ADMode.Backward, value)
        dr.traverse(dr.ADMode.Backward)

    def _image(self, scene: mi.Scene, sensor: mi.Sensor | int, spp: int) -> mi.TensorXf:
        """Samples averaged into pixels."""
        n, camera = self._side(spp), sensor_of(scene, sensor)
        values = self._samples(scene, camera, n)
        width, height = camera.film().crop_size()
        count = len(values)
        flat = dr.zeros(mi.Float, width * height * count)
        pixel = dr.arange(mi.UInt32, width * height)
        for channel, value in enumerate(values):
            mean = value if n == 1 else dr.block_sum(value, n * n) / (n * n)
            dr.scatter(flat, mean, pixel * count + channel)
        return mi.TensorXf(flat, (height, width, count))

    def _samples(self, scene: mi.Scene, camera: mi.Sensor, n: int) -> list[mi.Float]:
        """C values per sample, n x n samples per pixel, ordered by pixel."""
        raise NotImplementedError

    def _side(self, spp: int) -> int:
        """n for n x n samples per pixel."""
        if spp == 0:
            return self.antialias
        side = math.isqrt(spp)
        if side * side != spp:
            raise ConfigError(
                f"{self.plugin}: spp = {spp} cannot be a regular grid", "use a square number such as 4 or 16"
            )
        return side


def sensor_of(scene: mi.Scene, sensor: mi.Sensor | int) -> mi.Sensor:
    """The sensor, which may be the number of one of the scene's."""
    return scene.sensors()[sensor] if isinstance(sensor, int) else sensor


def film_positions(camera: mi.Sensor, n: int) -> mi.Point2f:
    """Where in [0, 1]^2 of the film's crop the n x n samples of every pixel are, ordered by pixel."""
    width, height = camera.film().crop_size()
    index = dr.arange(mi.UInt32, width * height * n * n)
    sample, pixel = index % (n * n), index // (n * n)
    x = mi.Float(pixel % width) + (mi.Float(sample % n) + 0.5) / n
    y = mi.Float(pixel // width) + (mi.Float(sample // n) + 0.5) / n
    return mi.Point2f(x / width, y / height)


def camera_ray(camera: mi.Sensor, position: mi.Point2f) -> mi.Ray3f:
    """The rays through positions of the film, and through the middle of the lens."""
    return camera.sample_ray(camera.shutter_open(), 0.5, position, mi.Point2f(0.5))[0]


def first_hits(scene: mi.Scene, ray: mi.Ray3f) -> mi.SurfaceInteraction3f:
    """What rays see first."""
    hit = scene.ray_intersect_preliminary(ray, coherent=True)
    return hit.compute_surface_interaction(ray, mi.RayFlags.All | mi.RayFlags.DetachShape, hit.is_valid())


def check_shapes(texture: mi.Texture, shapes: Iterable[mi.Shape]) -> None:
    """Raises a ConfigError if a field of Mitex cannot be put on one of the shapes."""
    if isinstance(texture, Field):
        for shape in shapes:
            texture.check_shape(shape)


def channels(field: Field, si: mi.SurfaceInteraction3f, active: mi.Bool) -> list[mi.Float]:
    """All channels of a field of Mitex at points, attached to its data but not to where they are."""
    with dr.suspend_grad():
        located = field.locate(si, active)
    return field.gather(located)
