"""Light that reaches a vertex of a path from a source: multiple importance sampling (Veach 1997)."""

from __future__ import annotations

from collections.abc import Callable

from mitex.runtime.jit import dr, mi


def sampled_light(
    scene: mi.Scene,
    interaction: mi.Interaction3f,
    sample: mi.Point2f,
    reflected: Callable[[mi.Vector3f], tuple[mi.Spectrum, mi.Float]],
    passing: Callable[[mi.Ray3f, mi.Bool], mi.Float],
    active: mi.Bool,
) -> mi.Spectrum:
    """Light from one source that is drawn, weighted against directions that the reflection draws.

    Args:
        scene: whose sources and shapes count.
        interaction: the vertices.
        sample: uniform numbers in [0, 1).
        reflected: of unit directions towards a source the reflection times the cosine, and the density with
            which it draws them.
        passing: the share of the light that the field lets pass on rays to the source.
        active: which of the vertices get any.
    """
    ds, weight = scene.sample_emitter_direction(interaction, sample, True, active)
    active = active & (ds.pdf > 0)
    value, density = reflected(ds.d)
    share = dr.select(ds.delta, 1, power_heuristic(ds.pdf, density))
    return dr.select(active, value * weight * share * passing(interaction.spawn_ray_to(ds.p), active), 0)


def reflection_at(
    context: mi.BSDFContext, bsdf: mi.BSDFPtr, si: mi.SurfaceInteraction3f, active: mi.Bool
) -> Callable[[mi.Vector3f], tuple[mi.Spectrum, mi.Float]]:
    """The argument `reflected` of `sampled_light`, of the BSDF of a shape."""
    return lambda direction: bsdf.eval_pdf(context, si, si.to_local(direction), active)


def source_met(
    scene: mi.Scene,
    si: mi.SurfaceInteraction3f,
    start: mi.Interaction3f,
    pdf: mi.Float,
    delta: mi.Bool,
    active: mi.Bool,
) -> mi.Spectrum:
    """Light of the source that a ray meets at `si`.

    Args:
        scene: whose sources count.
        si: where the ray ends; where nowhere, it sees the environment.
        start: where it comes from.
        pdf: density with which its direction was drawn [1 / sr].
        delta: no source could have been drawn there: it counts fully.
        active: which of the rays count.
    """
    emitter = si.emitter(scene)
    ds = mi.DirectionSample3f(scene, si, start)
    other = scene.pdf_emitter_direction(start, ds, active & ~delta)
    share = dr.select(delta, 1, power_heuristic(pdf, other))
    return dr.select(active, emitter.eval(si, active) * share, 0)


def power_heuristic(a: mi.Float, b: mi.Float) -> mi.Float:
    """The weight of a sample of density `a` that could have been drawn with density `b`, too."""
    return dr.select(a > 0, a * a / (a * a + b * b), 0)
