"""The networks that read the features of a point: density and reflection (section 3.1.4).

The weights belong to whoever trains them, and come in with each call.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from mitex.methods.nerf.field.mlp import network_rows, packed_networks
from mitex.methods.nerf.field.networks import COARSE, LAYERS, OCTAVES, REFLECTION, Networks
from mitex.methods.nerf.field.tensors import stack_rows, unstack_rows
from mitex.runtime.jit import dr, mi

HIGHEST = 15.0  # exponent of the density
DULL = 3.0  # taken from the logit of k_s at grazing angles: surfaces start dull there


@dataclass
class Reflection:
    """What the networks predict at a point.

    Attributes:
        exponent: natural logarithm of the density [1 / scene units].
        diffuse: k_d, `mi.Color3f` in [0, 1].
        specular: k_s in [0, 1], where the surface faces the viewer.
        grazing: the same at grazing angles; k_s again as published.
        glossiness: g, at least 1.
        theta, phi: elevation and azimuth of the fine normal in the frame of the face [rad], unbounded.
    """

    exponent: mi.Float
    diffuse: mi.Color3f
    specular: mi.Float
    grazing: mi.Float
    glossiness: mi.Float
    theta: mi.Float
    phi: mi.Float

    @property
    def density(self) -> mi.Float:
        """[1 / scene units], bounded."""
        return dr.exp(dr.minimum(self.exponent, HIGHEST))

    @property
    def reflectances(self) -> list[mi.Float]:
        """k_d (3) and k_s at both ends of its range, all in [0, 1]."""
        return [*self.diffuse, self.specular, self.grazing]

    def specular_at(self, cosine: mi.Float | float) -> mi.Float:
        """k_s under an angle to the normal, by Schlick's law with both ends learned (Hoffman 2019)."""
        return self.specular + (self.grazing - self.specular) * (1 - cosine) ** 5

    def normal(self, tangent: mi.Vector3f, bitangent: mi.Vector3f, normal: mi.Vector3f) -> mi.Vector3f:
        """The fine normal: R(theta, phi) of equation 4 in a frame of orthonormal vectors; unit."""
        sin_theta, cos_theta = dr.sincos(self.theta)
        sin_phi, cos_phi = dr.sincos(self.phi)
        return tangent * (sin_theta * cos_phi) + bitangent * (sin_theta * sin_phi) + normal * cos_theta


class Decoder:
    """The networks from features and signed distance to density and reflection.

    Args:
        weights: matrices (out, in) as of `weight_shapes`, each a `mi.TensorXf`.
        packed: evaluate as cooperative vectors where nothing has derivatives, which is faster.
        low_precision: multiply gradients in bfloat16 where points do not move; outputs are the same.
    """

    def __init__(
        self, weights: Sequence[mi.TensorXf], packed: bool = False, low_precision: bool = False
    ) -> None:
        self._low_precision = low_precision
        remaining = iter(weights)
        self.weights = {name: [next(remaining) for _ in widths[1:]] for name, widths in LAYERS.items()}
        self._packed: dict[str, dr.nn.Module] | None = {} if packed else None
        self.pack()

    @property
    def parameters(self) -> dict[str, mi.TensorXf]:
        """The matrices by name, such as `density.0`."""
        return {f"{name}.{k}": w for name, net in self.weights.items() for k, w in enumerate(net)}

    def pack(self) -> None:
        """Packs the matrices again, after they have changed."""
        if self._packed is not None:
            self._packed = dict(zip(LAYERS, packed_networks(*self.weights.values()), strict=True))

    def exponent(self, f: Sequence[mi.Float], distance: mi.Float) -> mi.Float:
        """The natural logarithm of the density [1 / scene units] alone; arguments as of a call."""
        fine = frequency_encoding(distance)
        packed = self._packed_for(f, fine)
        return network_rows((packed or self.weights)["density"], [*f, *fine])[0]

    def __call__(self, f: Sequence[mi.Float], phase: Sequence[mi.Float], distance: mi.Float) -> Reflection:
        """Density and reflection for features f (16 arrays), f-hat (8) and signed distance [scene units]."""
        fine = frequency_encoding(distance)
        run = self._cooperative if self._packed_for(f, phase, fine) else self._together
        exponent, *reflection, theta, phi = run([*f], [*phase], fine)
        *diffuse, specular, glossiness = reflection[:REFLECTION]
        specular, grazing = sigmoid(specular), reflection[REFLECTION:]
        return Reflection(
            exponent,
            mi.Color3f(*(sigmoid(k) for k in diffuse)),
            specular,
            sigmoid(grazing[0] - DULL) if grazing else specular,
            _softplus(glossiness) + 1,
            theta,
            phi,
        )

    def _cooperative(self, f: list[mi.Float], phase: list[mi.Float], fine: list[mi.Float]) -> list[mi.Float]:
        assert self._packed is not None
        exponent, *code = network_rows(self._packed["density"], f + fine)
        reflection = network_rows(self._packed["reflection"], code)
        theta = network_rows(self._packed["theta"], f + fine[:COARSE])
        return [exponent, *reflection, *theta, *network_rows(self._packed["phi"], phase + fine[:COARSE])]

    def _together(self, f: list[mi.Float], phase: list[mi.Float], fine: list[mi.Float]) -> list[mi.Float]:
        nets = list(self.weights.values())
        learning, moving = any(map(dr.grad_enabled, nets)), dr.grad_enabled(fine)
        values = stack_rows(fine[COARSE:] + fine[:COARSE] + f + phase)
        return unstack_rows(dr.custom(Networks, values, nets, learning, moving, self._low_precision))

    def _packed_for(self, *inputs: Sequence[mi.Float]) -> dict[str, dr.nn.Module] | None:
        """The packed networks, unless derivatives are asked for: their layout has none."""
        attached = dr.grad_enabled([*self.weights.values()], [list(values) for values in inputs])
        return None if attached else self._packed


def frequency_encoding(distance: mi.Float) -> list[mi.Float]:
    """The signed distance itself, then its sine and cosine at 12 octaves from 1 rad per scene unit on."""
    values = [distance]
    for octave in range(OCTAVES):
        values += dr.sincos(distance * 2.0**octave)
    return values


def sigmoid(x: mi.Float) -> mi.Float:
    """1 / (1 + exp(-x)), which never overflows."""
    return 0.5 * dr.tanh(0.5 * x) + 0.5


def _softplus(x: mi.Float) -> mi.Float:
    return dr.maximum(x, 0) + dr.log(1 + dr.exp(-dr.abs(x)))
