"""`shell`: a path tracer for scenes with a radiance field in a shell around a mesh."""

from __future__ import annotations

from mitex.errors import ConfigError
from mitex.integrators.field_paths import FieldPaths, evaluate, first_segment
from mitex.integrators.sources import reflection_at, sampled_light, source_met
from mitex.runtime.jit import dr, mi
from mitex.textures.variant import for_variant


class ShellIntegrator(FieldPaths):
    """Ordinary geometry by path tracing, with a radiance field composited by depth on every segment.

    A field gives what it emits towards the viewer under its own light and hides what is behind: paths that
    go on behind it, shadow rays too, keep what passes. So it is seen in mirrors and through glass, covers
    what is behind, is covered by what is in front, and casts shadows. Light of the scene does not fall on it.

    .. pluginparameters::

     * - field
       - |volume|
       - The radiance field, an object that `mitex.textures.shell_field.shell_field` makes.
       - exposed, differentiable
     * - max_depth
       - |int|
       - Longest path in the scene, at least 1 [segments]. (Default: 6)
     * - hide_emitters
       - |bool|
       - Show nothing where the camera sees light sources directly. (Default: false)

    Variants: llvm_ad_rgb and cuda_ad_rgb. Others are a ConfigError.

    Images are differentiable in the field's parameters.
    """

    plugin = "shell"
    differentiable = True

    def _check_field(self, field: object) -> None:
        if not hasattr(field, "march"):
            raise ConfigError("shell: 'field' is not a shell_field", "see mitex.textures.shell_field")

    def _radiance(
        self, scene: mi.Scene, sampler: mi.Sampler, ray: mi.Ray3f, active: mi.Bool
    ) -> tuple[mi.Spectrum, mi.Bool]:
        count = dr.width(ray.o)
        alive = active & dr.full(mi.Bool, True, count)
        radiance, throughput, valid, start, pdf, delta = first_segment(count)
        context = mi.BSDFContext()
        dr.make_opaque(alive)
        evaluate(sampler, ray)
        for depth in range(self.max_depth):
            si = scene.ray_intersect(ray, alive)
            segment = mi.Ray3f(ray)
            segment.maxt = dr.select(si.is_valid(), si.t, dr.inf)
            segment_light = self.field.march(segment, sampler.next_1d(alive), alive)
            radiance += throughput * _linear(segment_light.colour, 1 - segment_light.transmittance)
            throughput *= segment_light.transmittance
            valid |= alive & (si.is_valid() | (segment_light.transmittance < 0.5))
            emitted = source_met(scene, si, start, pdf, delta, alive & mi.Bool(depth or not self.hidden))
            radiance += throughput * emitted
            alive &= si.is_valid() & (dr.max(dr.detach(throughput)) > 0)
            if depth + 1 == self.max_depth or dr.none(alive):
                break
            bsdf = si.bsdf(ray)
            radiance += throughput * self._direct(scene, sampler, context, bsdf, si, alive)
            scattered, weight = bsdf.sample(
                context, si, sampler.next_1d(alive), sampler.next_2d(alive), alive
            )
            throughput *= dr.select(alive, weight, 0)
            start, pdf = mi.Interaction3f(si), scattered.pdf
            delta = mi.has_flag(scattered.sampled_type, mi.BSDFFlags.Delta)
            ray = si.spawn_ray(si.to_world(scattered.wo))
            alive &= dr.max(dr.detach(throughput)) > 0
            evaluate(sampler, ray, radiance, throughput, alive, start, pdf, delta, valid)
        return radiance, valid

    def _direct(
        self,
        scene: mi.Scene,
        sampler: mi.Sampler,
        context: mi.BSDFContext,
        bsdf: mi.BSDFPtr,
        si: mi.SurfaceInteraction3f,
        active: mi.Bool,
    ) -> mi.Spectrum:
        """Light from a sampled source, weighted against the BSDF's own sampling; the field casts shadows."""
        smooth = active & mi.has_flag(bsdf.flags(), mi.BSDFFlags.Smooth)

        def passing(ray: mi.Ray3f, active: mi.Bool) -> mi.Float:
            return self.field.march(ray, sampler.next_1d(active), active).transmittance

        reflected = reflection_at(context, bsdf, si, smooth)
        return sampled_light(scene, si, sampler.next_2d(smooth), reflected, passing, smooth)


def _linear(display: mi.Color3f, opacity: mi.Float) -> mi.Spectrum:
    """Linear radiance, times opacity, of display values times opacity: fields blend in display values."""
    safe = dr.maximum(opacity, 1e-6)
    value = dr.clip(display / safe, 0, 1)
    return mi.Spectrum(mi.math.srgb_to_linear(value) * safe)


def register() -> None:
    """Registers the integrator for the current variant."""
    cls = for_variant(mi.SamplingIntegrator, ShellIntegrator)
    mi.register_integrator("shell", lambda props: cls(props))
