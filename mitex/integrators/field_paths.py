"""What the integrators of scenes with a radiance field share: they trace paths around and through it."""

from __future__ import annotations

from typing import Any

from mitex.errors import ConfigError
from mitex.runtime.jit import dr, mi
from mitex.textures.shell_field import ShellField, works_in_variant
from mitex.textures.variant import init_base, option, require_variant


class FieldPaths:
    """Members of an integrator's plugin class; a subclass adds `_check_field` and `_radiance`."""

    plugin: str  # type of the plugin, for messages
    differentiable: bool  # whether images are, in the field's parameters

    def __init__(self, props: mi.Properties) -> None:
        init_base(mi.SamplingIntegrator, self, props)
        require_variant(self.plugin, works_in_variant(), "llvm_ad_rgb or cuda_ad_rgb")
        field: Any = props.get("field")
        self._check_field(field)
        self.field: ShellField = field
        self.max_depth = option(props, "max_depth", 6)
        if self.max_depth < 1:
            raise ConfigError(f"{self.plugin}: 'max_depth' is {self.max_depth}", "use 1 or more")
        self.hidden = option(props, "hide_emitters", False)

    def _check_field(self, field: object) -> None:
        """Raises a ConfigError if that is no field that the integrator can trace paths through."""
        raise NotImplementedError

    def traverse(self, callback: mi.TraversalCallback) -> None:
        flags = mi.ParamFlags.Differentiable if self.differentiable else mi.ParamFlags.NonDifferentiable
        callback.put("field", self.field, flags)

    def aov_names(self) -> list[str]:
        return []

    def to_string(self) -> str:
        nested = str(self.field).replace("\n", "\n  ")
        return f"{type(self).__name__}[\n  field = {nested},\n  max_depth = {self.max_depth}\n]"

    def sample(
        self,
        scene: mi.Scene,
        sampler: mi.Sampler,
        ray: mi.Ray3f,
        medium: mi.Medium | None = None,
        active: mi.Bool | bool = True,
    ) -> tuple[mi.Spectrum, mi.Bool, list[mi.Float]]:
        """Radiance along rays, as one wavefront: the march cannot be recorded into a symbolic loop."""
        return (*self._radiance(scene, sampler, mi.Ray3f(ray), mi.Bool(active)), [])

    def _radiance(
        self, scene: mi.Scene, sampler: mi.Sampler, ray: mi.Ray3f, active: mi.Bool
    ) -> tuple[mi.Spectrum, mi.Bool]:
        """Radiance along R rays, and which of them meet something."""
        raise NotImplementedError


def first_segment(
    count: int,
) -> tuple[mi.Spectrum, mi.Spectrum, mi.Bool, mi.Interaction3f, mi.Float, mi.Bool]:
    """What is known of `count` paths that begin at a camera: radiance, throughput, whether they have met
    anything, where their last direction was drawn, with which density, and whether no light source can be
    drawn in it: those hit after a mirror, or at once, count fully.

    Opaque, as all is after a segment, so that the same kernels do for the first one.
    """
    radiance, throughput = dr.zeros(mi.Spectrum, count), dr.ones(mi.Spectrum, count)
    valid = dr.zeros(mi.Bool, count)
    start, pdf, delta = dr.zeros(mi.Interaction3f, count), dr.ones(mi.Float, count), dr.ones(mi.Bool, count)
    dr.make_opaque(radiance, throughput, valid, start, pdf, delta)
    return radiance, throughput, valid, start, pdf, delta


def evaluate(sampler: mi.Sampler, *state: Any) -> None:
    """Evaluates what is known of paths between two segments, and the sampler: else what it did before would
    be in the kernels of every later segment."""
    sampler.schedule_state()
    dr.eval(state)
