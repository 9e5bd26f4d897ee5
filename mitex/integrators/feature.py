"""`feature`: a Mitsuba integrator that images the channels of a texture, differentiably."""

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
from mitex.textures.scene_objects import nested
from mitex.textures.variant import for_variant, option


class FeatureIntegrator(GridIntegrator):
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

    plugin = "feature"

    def __init__(self, props: mi.Properties) -> None:
        self._read(props)
        self.name = option(props, "name", "")
        if (self.field is None) == (not self.name):
            raise ConfigError(
                f"feature: {'no' if self.field is None else 'both'} 'field' and 'name'",
                "give either a nested texture 'field' or the 'name' of each shape's texture",
            )
        background = props.get("background", 0.0)
        self.background = mi.Float(background.array if isinstance(background, mi.TensorXf) else background)

    def traverse(self, callback: mi.TraversalCallback) -> None:
        if self.field is not None:
            callback.put("field", self.field, mi.ParamFlags.Differentiable)
        callback.put("background", self.background, mi.ParamFlags.Differentiable)

    def to_string(self) -> str:
        nested = str(self.field).replace("\n", "\n  ")
        source = f"field = {nested}" if self.field is not None else f"name = {self.name}"
        return (
            f"FeatureIntegrator[\n  {source},\n  background = {self.background},\n"
            f"  antialias = {self.antialias}\n]"
        )

    def _samples(self, scene: mi.Scene, camera: mi.Sensor, n: int) -> list[mi.Float]:
        fields = self.fields(scene)
        with dr.suspend_grad():
            si = first_hits(scene, camera_ray(camera, film_positions(camera, n)))
            hit = si.is_valid()
        values: list[mi.Float] = []
        covered = mi.Bool(False)
        for shape, texture in fields:
            check_shapes(texture, scene.shapes() if shape is None else [shape])
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
        return [dr.select(covered, v, b) for v, b in zip(values, backgrounds, strict=True)]

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


def _evaluate(texture: mi.Texture, si: mi.SurfaceInteraction3f, active: mi.Bool) -> list[mi.Float]:
    """All channels of a Mitex field, else those of a colour."""
    if isinstance(texture, Field):
        return channels(texture, si, active)
    if mi.is_spectral:
        raise ConfigError(
            f"feature: in the spectral variant '{mi.variant()}' it does not image Mitsuba's own textures",
            "use a field of Mitex, or an rgb or mono variant",
        )
    return list(texture.eval(si, active))


def register() -> None:
    """Registers the integrator for the current variant."""
    cls = for_variant(mi.CppADIntegrator, FeatureIntegrator)
    mi.register_integrator("feature", lambda props: cls(props))
