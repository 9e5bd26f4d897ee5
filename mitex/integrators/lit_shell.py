"""`lit_shell`: a path tracer in which the light of the scene falls on a radiance field."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

from mitex.errors import ConfigError
from mitex.integrators.field_paths import FieldPaths, evaluate, first_segment
from mitex.integrators.sources import reflection_at, sampled_light, source_met
from mitex.runtime.jit import dr, mi
from mitex.textures.scattering import ReflectingField
from mitex.textures.variant import for_variant

# A path goes on so many of the field's steps above the place where it met matter, along the normal: what the
# captured photos show as a surface is a layer of matter, which would shade itself.
LIFT = 3.0


@dataclass
class Vertex:
    """Where paths are scattered, and how they go on; all of one width.

    Attributes:
        interaction: from where.
        light: that falls on it straight from a source and is reflected along the path.
        direction: in which the path goes on, unit, in the world.
        weight: of what comes from there.
        pdf: density with which the direction was drawn [1 / sr].
        delta: no light source can be drawn in that direction.
    """

    interaction: mi.Interaction3f
    light: mi.Spectrum
    direction: mi.Vector3f
    weight: mi.Spectrum
    pdf: mi.Float
    delta: mi.Bool


class LitShellIntegrator(FieldPaths):
    """Path tracing of ordinary geometry and of a radiance field that reflects the scene's own light.

    Each ray draws one place among those that it sees in the field, with the weights of compositing. There
    the path is scattered as at a surface, by the field's normal and Phong reflection; the light in which the
    field was captured is left out. So the scene lights the field, and the scene and the field itself cast
    shadows on it.

    .. pluginparameters::

     * - field
       - |volume|
       - The field, an object that `mitex.textures.shell_field.shell_field` makes of a field with a
         reflection, a `mitex.textures.scattering.ReflectingField`.
       - exposed
     * - max_depth
       - |int|
       - Longest path in the scene, at least 1 [segments]. (Default: 6)
     * - hide_emitters
       - |bool|
       - Show nothing where the camera sees light sources directly. (Default: false)

    Variants: llvm_ad_rgb and cuda_ad_rgb. Others are a ConfigError.

    Images are not differentiable in the field's parameters; those of `shell` are.
    """

    plugin = "lit_shell"
    differentiable = False

    def _check_field(self, field: object) -> None:
        if not isinstance(getattr(field, "field", None), ReflectingField):
            raise ConfigError(
                "lit_shell: 'field' is not a shell_field that reflects light",
                "give a texture of `mitex fit nerf`, or use `shell`, which renders it in its own light",
            )

    def _radiance(
        self, scene: mi.Scene, sampler: mi.Sampler, ray: mi.Ray3f, active: mi.Bool
    ) -> tuple[mi.Spectrum, mi.Bool]:
        with dr.suspend_grad():
            return self._scattered(scene, sampler, ray, active)

    def _scattered(
        self, scene: mi.Scene, sampler: mi.Sampler, ray: mi.Ray3f, active: mi.Bool
    ) -> tuple[mi.Spectrum, mi.Bool]:
        count = dr.width(ray.o)
        alive = mi.Bool(active & dr.full(mi.Bool, True, count))
        radiance, throughput, valid, start, pdf, delta = first_segment(count)
        dr.make_opaque(alive)
        evaluate(sampler, ray)
        for depth in range(self.max_depth):
            si = scene.ray_intersect(ray, alive)
            segment = mi.Ray3f(ray)
            segment.maxt = dr.select(si.is_valid(), si.t, dr.inf)
            t = self.field.flight(segment, sampler.next_1d(alive), sampler.next_1d(alive), alive)
            matter = mi.Bool(alive & (t < dr.inf))
            seen = mi.Bool(alive & ~matter & mi.Bool(depth or not self.hidden))
            radiance += throughput * source_met(scene, si, start, pdf, delta, seen)
            surface = mi.Bool(alive & ~matter & si.is_valid())
            valid |= surface | matter
            if depth + 1 == self.max_depth or dr.none(surface | matter):
                break
            vertex = self._on_surface(scene, sampler, ray, si, surface)
            if dr.any(matter):
                _replace(vertex, self._in_matter(scene, sampler, ray, t, matter), matter)
            radiance += throughput * vertex.light
            throughput *= dr.select(surface | matter, vertex.weight, 0)
            start, pdf, delta = vertex.interaction, vertex.pdf, vertex.delta
            ray = start.spawn_ray(vertex.direction)
            alive = mi.Bool(dr.max(throughput) > 0)
            evaluate(sampler, ray, radiance, throughput, alive, start, pdf, delta, valid)
        return radiance, valid

    def _on_surface(
        self,
        scene: mi.Scene,
        sampler: mi.Sampler,
        ray: mi.Ray3f,
        si: mi.SurfaceInteraction3f,
        active: mi.Bool,
    ) -> Vertex:
        """Scattering by the BSDF where rays meet a shape."""
        context, bsdf = mi.BSDFContext(), si.bsdf(mi.RayDifferential3f(ray))
        smooth = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)
        light = self._light(scene, sampler, si, reflection_at(context, bsdf, si, smooth), smooth)
        scattered, weight = bsdf.sample(context, si, sampler.next_1d(active), sampler.next_2d(active), active)
        delta = mi.has_flag(scattered.sampled_type, mi.BSDFFlags.Delta)
        return Vertex(mi.Interaction3f(si), light, si.to_world(scattered.wo), weight, scattered.pdf, delta)

    def _in_matter(
        self, scene: mi.Scene, sampler: mi.Sampler, ray: mi.Ray3f, t: mi.Float, active: mi.Bool
    ) -> Vertex:
        """Scattering by the field's reflection at the distances t along rays."""
        solid, phong = self.field.reflection(ray(t), ray.d, active)
        lift = dr.opaque(mi.Float, LIFT * self.field.world_step)  # a literal would ask for another kernel
        lifted = ray(t) + mi.Point3f(phong.normal * lift)
        interaction = mi.Interaction3f(t, ray.time, ray.wavelengths, lifted, mi.Normal3f(phong.normal))

        def reflected(direction: mi.Vector3f) -> tuple[mi.Spectrum, mi.Float]:
            value, pdf = phong.eval_pdf(ray.d, direction)
            return mi.Spectrum(value), pdf

        light = self._light(scene, sampler, interaction, reflected, solid)
        direction = phong.sample(ray.d, sampler.next_1d(solid), sampler.next_2d(solid))
        value, pdf = reflected(direction)
        weight = dr.select(solid & (pdf > 0), value / pdf, 0)
        return Vertex(interaction, light, direction, weight, pdf, dr.zeros(mi.Bool, dr.width(solid)))

    def _light(
        self,
        scene: mi.Scene,
        sampler: mi.Sampler,
        interaction: mi.Interaction3f,
        reflected: Callable[[mi.Vector3f], tuple[mi.Spectrum, mi.Float]],
        active: mi.Bool,
    ) -> mi.Spectrum:
        def passing(ray: mi.Ray3f, active: mi.Bool) -> mi.Float:
            t = self.field.flight(ray, sampler.next_1d(active), sampler.next_1d(active), active)
            return dr.select(t < dr.inf, mi.Float(0), 1)

        return sampled_light(scene, interaction, sampler.next_2d(active), reflected, passing, active)


def _replace(vertex: Vertex, other: Vertex, where: mi.Bool) -> None:
    """Takes over the fields of another vertex at some places."""
    for name, value in vars(other).items():
        setattr(vertex, name, dr.select(where, value, getattr(vertex, name)))


def register() -> None:
    """Registers the integrator for the current variant."""
    cls = for_variant(mi.SamplingIntegrator, LitShellIntegrator)
    mi.register_integrator("lit_shell", lambda props: cls(props))
