"""`feature`: a Mitsuba integrator that images the channels of a texture, differentiably."""

from __future__ import annotations

import math
from collections.abc import Iterable
from typing import Any

from mitex.errors import ConfigError
from mitex.runtime.jit import dr, mi
from mitex.textures.field import Field
from mitex.textures.shown import nested
from mitex.textures.variant import for_variant, init_base, option, require_variant


class FeatureIntegrator:
    """Images a texture on the visible surface: H x W x C values, no light, any sensor including `batch`.

    .. pluginparameters::

     * - field
       - |texture|
       - The texture to image, on every shape: all channels of a `vertex_field`, `texel_field` or
         `decoded_field`; of any other the colour that `eval` gives (3 channels in rgb variants, 1 in mono,
         none in spectral ones). Give this or `name`.
       - exposed, differentiable
     * - name
       - |string|
       - Instead of `field`: the name under which each shape, its BSDF or a BSDF inside that holds its own
         texture, for instance `reflectance`. Shapes without one show the background. (Default: none)
     * - background
       - |float| or |tensor|
       - Value of rays that see nothing: a number for all channels, or a tensor (C,). (Default: 0)
       - exposed, differentiable
     * - antialias
       - |int|
       - n for n x n samples per pixel at the centres of a regular grid, averaged (box filter). 1 is one
         sample at the pixel's centre. An `spp` given to `mi.render` replaces it and must be a square number.
         (Default: 1)

    Variants: llvm and cuda ones; in spectral ones only the fields of Mitex. Others are a ConfigError.

    The sensor's sampler and reconstruction filter are not used: the image is deterministic, the seed has no
    effect. The result is returned and not stored in the film, which has no room for C channels.

    Visibility and where a lookup reads are detached, lookups are attached: `mi.render` differentiates with
    respect to the parameters of the texture and `background`, not to geometry or cameras. The adjoint is that
    of the samples' values, by automatic differentiation, so values need not be linear in the data; of a
    `vertex_field` or `texel_field` it is a scatter of the image's gradient with the weights of the forward
    pass. No derivative passes through ray tracing or film. Calling `render` directly with attached parameters
    returns an attached image.
    """

    def __init__(self, props: mi.Properties) -> None:
        init_base(mi.CppADIntegrator, self, props)
        require_variant("feature", dr.is_jit_v(mi.Float), "an llvm or cuda one")
        field = props.get("field")
        self.name = option(props, "name", "")
        if (field is None) == (not self.name):
            raise ConfigError(
                f"feature: {'no' if field is None else 'both'} 'field' and 'name'",
                "give either a nested texture 'field' or the 'name' of each shape's texture",
            )
        if field is not None and not isinstance(field, mi.Texture):
            raise ConfigError(f"feature: 'field' is a {type(field).__name__}", "give a texture")
        self.field = field
        background = props.get("background", 0.0)
        self.background = mi.Float(background.array if isinstance(background, mi.TensorXf) else background)
        self.antialias = option(props, "antialias", 1)
        if self.antialias < 1:
            raise ConfigError(f"feature: 'antialias' is {self.antialias}", "use 1 or more")

    def traverse(self, callback: mi.TraversalCallback) -> None:
        if self.field is not None:
            callback.put("field", self.field, mi.ParamFlags.Differentiable)
        callback.put("background", self.background, mi.ParamFlags.Differentiable)

    def aov_names(self) -> list[str]:
        return []

    def to_string(self) -> str:
        nested = str(self.field).replace("\n", "\n  ")
        source = f"field = {nested}" if self.field is not None else f"name = {self.name}"
        return (
            f"FeatureIntegrator[\n  {source},\n  background = {self.background},\n"
            f"  antialias = {self.antialias}\n]"
        )

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
            raise ConfigError("feature: the film holds no result", "render with develop=True")
        image = self._image(scene, sensor, spp)[1]
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
            image = self._image(scene, sensor, spp)[1]
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
        with dr.resume_grad():
            values, n = self._samples(scene, sensor, spp)
        pixel = dr.arange(mi.UInt32, dr.width(values[0])) // (n * n)
        adjoint = dr.detach(grad_in.array) / (n * n)
        for channel, value in enumerate(values):
            if dr.grad_enabled(value):
                dr.set_grad(value, dr.gather(mi.Float, adjoint, len(values) * pixel + channel))
                dr.enqueue(dr.ADMode.Backward, value)
        dr.traverse(dr.ADMode.Backward)

    def _image(
        self, scene: mi.Scene, sensor: mi.Sensor | int, spp: int
    ) -> tuple[list[mi.Float], mi.TensorXf]:
        """Samples averaged into pixels."""
        values, n = self._samples(scene, sensor, spp)
        width, height = _sensor(scene, sensor).film().crop_size()
        count = len(values)
        flat = dr.zeros(mi.Float, width * height * count)
        pixel = dr.arange(mi.UInt32, width * height)
        for channel, value in enumerate(values):
            mean = value if n == 1 else dr.block_sum(value, n * n) / (n * n)
            dr.scatter(flat, mean, pixel * count + channel)
        return values, mi.TensorXf(flat, (height, width, count))

    def _samples(self, scene: mi.Scene, sensor: mi.Sensor | int, spp: int) -> tuple[list[mi.Float], int]:
        """C values per sample, ordered by pixel, and n for n x n samples per pixel."""
        n = self._side(spp)
        fields = self.fields(scene)
        with dr.suspend_grad():
            si = _first_hits(scene, sensor, n)
            hit = si.is_valid()
        values: list[mi.Float] = []
        covered = mi.Bool(False)
        for shape, texture in fields:
            _check_shapes(texture, scene.shapes() if shape is None else [shape])
            mask = hit if shape is None else hit & (si.shape == mi.ShapePtr(shape))
            new = _evaluate(texture, si, mask)
            if values and len(values) != len(new):
                raise ConfigError(
                    f"feature: the textures called '{self.name}' have {len(values)} and {len(new)} channels",
                    "give all of them the same number of channels",
                )
            values = [dr.select(mask, a, b) for a, b in zip(new, values or new, strict=True)]
            covered |= mask
        backgrounds = self._backgrounds(len(values))
        return [dr.select(covered, v, b) for v, b in zip(values, backgrounds, strict=True)], n

    def _side(self, spp: int) -> int:
        if spp == 0:
            return self.antialias
        side = math.isqrt(spp)
        if side * side != spp:
            raise ConfigError(
                f"feature: spp = {spp} cannot be a regular grid", "use a square number such as 4 or 16"
            )
        return side

    def fields(self, scene: mi.Scene) -> list[tuple[mi.Shape | None, mi.Texture]]:
        """The textures that are imaged, as (shape, texture) pairs; a shape of None stands for all shapes."""
        if self.field is not None:
            return [(None, self.field)]
        named = ((shape, textures_named(shape, self.name)) for shape in scene.shapes())
        pairs = [(shape, textures[0]) for shape, textures in named if textures]
        if not pairs:
            raise ConfigError(
                f"feature: no shape of the scene has a texture called '{self.name}'",
                "give the name of a parameter of a shape or BSDF, see mi.traverse(scene)",
            )
        return pairs

    def _backgrounds(self, channels: int) -> list[mi.Float]:
        count = dr.width(self.background)
        if count not in (1, channels):
            raise ConfigError(
                f"feature: 'background' has {count} values for {channels} channels", f"give 1 or {channels}"
            )
        return [dr.gather(mi.Float, self.background, c if count > 1 else 0) for c in range(channels)]


def textures_named(thing: mi.Shape | mi.BSDF, name: str) -> list[mi.Texture]:
    """Textures with the parameter name `name` in a shape or BSDF or nested in it, outermost first."""
    objects = nested(thing)
    textures = [value for key, value in objects.items() if key == name and isinstance(value, mi.Texture)]
    for child in objects.values():
        if isinstance(child, mi.BSDF):
            textures += textures_named(child, name)
    return textures


def _check_shapes(texture: mi.Texture, shapes: Iterable[mi.Shape]) -> None:
    if isinstance(texture, Field):
        for shape in shapes:
            texture.check_shape(shape)


def _evaluate(texture: mi.Texture, si: mi.SurfaceInteraction3f, active: mi.Bool) -> list[mi.Float]:
    """All channels of a Mitex field, else those of a colour."""
    if isinstance(texture, Field):
        with dr.suspend_grad():
            located = texture.locate(si, active)
        return texture.gather(located)
    if mi.is_spectral:
        raise ConfigError(
            f"feature: in the spectral variant '{mi.variant()}' it does not image Mitsuba's own textures",
            "use a field of Mitex, or an rgb or mono variant",
        )
    return list(texture.eval(si, active))


def _sensor(scene: mi.Scene, sensor: mi.Sensor | int) -> mi.Sensor:
    return scene.sensors()[sensor] if isinstance(sensor, int) else sensor


def _first_hits(scene: mi.Scene, sensor: mi.Sensor | int, n: int) -> mi.SurfaceInteraction3f:
    """Surface interactions of n x n regularly spaced rays per pixel, ordered by pixel."""
    camera = _sensor(scene, sensor)
    width, height = camera.film().crop_size()
    index = dr.arange(mi.UInt32, width * height * n * n)
    sample, pixel = index % (n * n), index // (n * n)
    x = mi.Float(pixel % width) + (mi.Float(sample % n) + 0.5) / n
    y = mi.Float(pixel // width) + (mi.Float(sample // n) + 0.5) / n
    position = mi.Point2f(x / width, y / height)
    ray, _ = camera.sample_ray(camera.shutter_open(), 0.5, position, mi.Point2f(0.5))
    hit = scene.ray_intersect_preliminary(ray, coherent=True)
    return hit.compute_surface_interaction(ray, mi.RayFlags.All | mi.RayFlags.DetachShape, hit.is_valid())


def register() -> None:
    """Registers the integrator for the current variant."""
    cls = for_variant(mi.CppADIntegrator, FeatureIntegrator)
    mi.register_integrator("feature", lambda props: cls(props))
