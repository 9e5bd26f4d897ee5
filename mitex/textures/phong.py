"""Phong's reflection, normalised, for light from any direction (Phong 1975; Lafortune and Willems 1994)."""

from __future__ import annotations

import math
from dataclasses import dataclass

from mitex.runtime.jit import dr, mi


@dataclass
class Phong:
    """What N points send back along view rays: kd cos / pi + ks (g + 1) / (2 pi) cos_r^g.

    The first cosine is that of the light's direction to the normal, the second that to the mirrored view
    ray, and each counts where it is positive. Where kd + ks is above 1 in a channel, both are scaled down: no
    point sends back more than it gets.

    Attributes:
        normal: unit, `mi.Vector3f`.
        diffuse: kd, linear `mi.Color3f` in [0, 1].
        specular: ks, `mi.Float` in [0, 1].
        glossiness: g, at least 0, `mi.Float`.
    """

    normal: mi.Vector3f
    diffuse: mi.Color3f
    specular: mi.Float
    glossiness: mi.Float

    def eval_pdf(self, view: mi.Vector3f, light: mi.Vector3f) -> tuple[mi.Color3f, mi.Float]:
        """Reflection times cosine, and the density with which `sample` draws it [1 / sr].

        Args:
            view: unit directions in which the view rays travel.
            light: unit directions that the light comes from.
        """
        mirrored = view - 2 * dr.dot(self.normal, view) * self.normal
        cosine = dr.maximum(dr.dot(self.normal, light), 0) / math.pi
        norm = (self.glossiness + 1) / (2 * math.pi)
        lobe = norm * dr.maximum(dr.dot(mirrored, light), 0) ** self.glossiness
        share, bound = self._share(), dr.maximum(dr.max(self.diffuse) + self.specular, 1)
        value = (self.diffuse * cosine + self.specular * lobe) / bound
        return value, dr.lerp(cosine, lobe, share)

    def sample(self, view: mi.Vector3f, choice: mi.Float, position: mi.Point2f) -> mi.Vector3f:
        """Unit directions of light, each drawn from one of the two lobes.

        Args:
            view: as of `eval_pdf`.
            choice, position: uniform numbers in [0, 1).
        """
        mirrored = view - 2 * dr.dot(self.normal, view) * self.normal
        glossy = choice < self._share()
        axis = dr.select(glossy, mirrored, self.normal)
        # The clamped cosine is the lobe of exponent 1.
        exponent = dr.select(glossy, self.glossiness, 1)
        cosine = dr.maximum(1 - position.x, 1e-7) ** dr.rcp(exponent + 1)
        sine = dr.safe_sqrt(1 - cosine * cosine)
        sin_phi, cos_phi = dr.sincos(2 * math.pi * position.y)
        return mi.Frame3f(axis).to_world(mi.Vector3f(sine * cos_phi, sine * sin_phi, cosine))

    def _share(self) -> mi.Float:
        """Of the samples, for the specular lobe."""
        return self.specular / dr.maximum(self.specular + dr.max(self.diffuse), 1e-6)
