"""The field: latent features on the base shape, and the networks that read them (section 3.1.4).

Everything here is Dr.Jit. The parameters belong to whoever trains them, and come in with each call: hash
tables as flat arrays, weights as matrices.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import torch
from torch.nn import functional as F

from mitex.methods.nerf import mlp
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.hash_grid import HashGrid
from mitex.methods.nerf.tensors import stacked, unstacked
from mitex.runtime import load_mitsuba

mi: Any = load_mitsuba(needs_llvm=False)
import drjit as dr  # noqa: E402  (Mitsuba first: it decides which LLVM Dr.Jit opens)
import drjit.nn as nn  # noqa: E402

OCTAVES = 12  # of the signed distance
FINE = 2 * OCTAVES + 1
COARSE = 12  # of those, what the angles see
FEATURES, PHASES = 16, 8  # channels of f and of f-hat
CODE = 15  # what the density network tells that of the reflection
REFLECTION = 5  # what that says as published: k_d, k_s, g; the sixth is k_s at grazing angles
LAYERS = {  # widths as published but for the sixth of the reflection, without biases
    "density": (FEATURES + FINE, 32, CODE + 1),
    "reflection": (CODE, 64, 64, REFLECTION + 1),
    "theta": (FEATURES + COARSE, 16, 16, 1),
    "phi": (PHASES + COARSE, 16, 16, 1),
}
MATRICES = sum(len(widths) - 1 for widths in LAYERS.values())
# Which of them is the last of theta's.
ELEVATION = sum(len(LAYERS[name]) - 1 for name in ("density", "reflection", "theta")) - 1
HIGHEST = 15.0  # exponent of the density
DULL = 3.0  # taken from the logit of k_s at grazing angles: surfaces start dull there


@dataclass
class Reflection:
    """What the networks say of a point.

    Attributes:
        exponent: natural logarithm of the density [1 / scene units].
        diffuse: k_d, `mi.Color3f` in [0, 1].
        specular: k_s in [0, 1], where the surface faces the viewer.
        grazing: the same at grazing angles; k_s again as published.
        glossiness: g, at least 1.
        theta, phi: elevation and azimuth of the fine normal in the frame of the face [rad], unbounded.
    """

    exponent: Any
    diffuse: Any
    specular: Any
    grazing: Any
    glossiness: Any
    theta: Any
    phi: Any

    @property
    def density(self) -> Any:
        return dr.exp(dr.minimum(self.exponent, HIGHEST))

    def mirrored(self, cosine: Any) -> Any:
        """k_s under an angle to the normal, by Schlick's law with both ends learned (Hoffman 2019)."""
        return self.specular + (self.grazing - self.specular) * (1 - cosine) ** 5

    def normal(self, tangent: Any, bitangent: Any, normal: Any) -> Any:
        """R(theta, phi) of equation 4 in a frame of `mi.Vector3f`s."""
        sin_theta, cos_theta = dr.sincos(self.theta)
        sin_phi, cos_phi = dr.sincos(self.phi)
        return tangent * (sin_theta * cos_phi) + bitangent * (sin_theta * sin_phi) + normal * cos_theta


class Encoding:
    """Hash grids of f and f-hat over the scene cube [-1, 1]^3, looked up at foot points.

    Args:
        config: number, resolution and size of the levels.
    """

    def __init__(self, config: NerfConfig) -> None:
        extent = config.coarsest, config.finest, config.table
        self.grids = [HashGrid(channels // 2, *extent) for channels in (FEATURES, PHASES)]

    @property
    def sizes(self) -> list[int]:
        """Lengths of the tables of f and f-hat."""
        return [grid.size for grid in self.grids]

    def levels(self, which: int) -> list[slice]:
        """Where the levels lie in a table, 0 of f or 1 of f-hat."""
        return self.grids[which].levels

    def __call__(self, which: int, foot: Any, table: Any) -> list[Any]:
        """Features at foot points, `mi.Point3f` in the cube: 0 for f (16 channels), 1 for f-hat (8)."""
        return self.grids[which](foot, table)


class Decoder:
    """The networks from features and signed distance to density and reflection.

    Args:
        weights: matrices (out, in) as of `weight_shapes`, each a `mi.TensorXf`.
        packed: evaluate as cooperative vectors: fast forwards, slow backwards.
    """

    def __init__(self, weights: Sequence[Any], packed: bool = False) -> None:
        given = iter(weights)
        self.weights = {name: [next(given) for _ in widths[1:]] for name, widths in LAYERS.items()}
        self._packed = (
            dict(zip(LAYERS, packed_networks(*self.weights.values()), strict=True)) if packed else {}
        )

    def exponent(self, f: Sequence[Any], distance: Any) -> Any:
        """Only the logarithm of the density."""
        return network_rows(self._net("density"), [*f, *embedded(distance)])[0]

    def __call__(self, f: Sequence[Any], phase: Sequence[Any], distance: Any) -> Reflection:
        """Density and reflection for features f (16 arrays), f-hat (8) and signed distance [scene units]."""
        run = self._cooperative if self._packed else self._together
        exponent, *reflection, theta, phi = run([*f], [*phase], embedded(distance))
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

    def _cooperative(self, f: list[Any], phase: list[Any], fine: list[Any]) -> list[Any]:
        exponent, *code = network_rows(self._packed["density"], f + fine)
        reflection = network_rows(self._packed["reflection"], code)
        theta = network_rows(self._packed["theta"], f + fine[:COARSE])
        return [exponent, *reflection, *theta, *network_rows(self._packed["phi"], phase + fine[:COARSE])]

    def _together(self, f: list[Any], phase: list[Any], fine: list[Any]) -> list[Any]:
        nets = list(self.weights.values())
        learning, moving = any(map(dr.grad_enabled, nets)), dr.grad_enabled(fine)
        values = stacked(fine[COARSE:] + f + fine[:COARSE] + phase)
        return unstacked(dr.custom(_Networks, values, nets, learning, moving))

    def _net(self, name: str) -> Any:
        return self._packed.get(name, self.weights[name])


# The networks' inputs, in an order in which what each reads is side by side: the fine part of the embedded
# distance, f, its coarse part, f-hat.
BEYOND = FINE - COARSE
READS = {
    "density": slice(0, BEYOND + FEATURES + COARSE),
    "theta": slice(BEYOND, BEYOND + FEATURES + COARSE),
    "phi": slice(BEYOND + FEATURES, BEYOND + FEATURES + COARSE + PHASES),
}
TURNED = {"density": BEYOND, "phi": COARSE}  # how far the first matrix's columns are turned for that
LEARNED = {"density": slice(BEYOND, BEYOND + FEATURES), "theta": slice(FEATURES), "phi": slice(COARSE, None)}


class _Networks(dr.CustomOp):
    """All four on N points: inputs (49, N) as above -> the outputs, (9, N) or, as published, (8, N).

    Only where points move (`moving`) does the distance get a gradient.
    """

    def eval(self, values: Any, nets: list[list[Any]], learning: bool, moving: bool) -> Any:
        self.learning, self.moving, self.values = learning, moving, values.torch()
        self.nets = {k: [w.torch() for w in net] for k, net in zip(LAYERS, nets, strict=True)}
        for name, columns in TURNED.items():
            self.nets[name][0] = self.nets[name][0].roll(columns, 1)
        # With a column of zeros for the exponent, 16 in all: products with 15 take three times as long.
        self.nets["reflection"][0] = F.pad(self.nets["reflection"][0], (1, 0))
        layers = {k: mlp.forwards(self.nets[k], self.values[rows]) for k, rows in READS.items()}
        layers["reflection"] = mlp.forwards(self.nets["reflection"], layers["density"][-1])
        self.layers = layers
        found = torch.cat([layers["density"][-1][:1], *(layers[k][-1] for k in list(LAYERS)[1:])])
        return mi.TensorXf(found)

    def backward(self) -> None:
        gradient: Any = self.grad_out()
        given = gradient.torch()
        exponent, *rest = given.split([1, *(len(self.nets[k][-1]) for k in list(LAYERS)[1:])])
        of = dict(zip(list(LAYERS)[1:], rest, strict=True))
        of["density"] = torch.cat([exponent, exponent.new_zeros(CODE, exponent.shape[1])])
        found = {"reflection": self._back("reflection", of["reflection"], of["density"])}
        of_values = torch.zeros_like(self.values)
        for name, rows in READS.items():
            learned = slice(None) if self.moving else LEARNED[name]
            found[name] = self._back(name, of[name], of_values[rows][learned], learned)
        if self.learning:
            for name, columns in TURNED.items():
                found[name][0] = found[name][0].roll(-columns, 1)
            found["reflection"][0] = found["reflection"][0][:, 1:].contiguous()
        self.set_grad_in("values", mi.TensorXf(of_values))
        if self.learning:
            self.set_grad_in("nets", [[mi.TensorXf(weight) for weight in found[k]] for k in LAYERS])

    def _back(
        self, name: str, gradient: torch.Tensor, into: torch.Tensor, inputs: slice = slice(None)
    ) -> list[torch.Tensor]:
        return mlp.backwards(self.nets[name], self.layers[name], gradient, self.learning, into, inputs)

    def name(self) -> str:
        return "networks"


def embedded(distance: Any) -> list[Any]:
    """The signed distance itself, then its sine and cosine at 12 octaves from 1 rad per scene unit on."""
    values = [distance]
    for octave in range(OCTAVES):
        values += dr.sincos(distance * 2.0**octave)
    return values


def weight_shapes(config: NerfConfig) -> list[tuple[int, int]]:
    """(out, in) of each matrix, in the order of `LAYERS`; settings say the density's width and `fresnel`."""
    layers = LAYERS | {"density": (FEATURES + FINE, config.density_width, CODE + 1)}
    if not config.fresnel:
        layers["reflection"] = (*LAYERS["reflection"][:-1], REFLECTION)
    return [(o, i) for widths in layers.values() for i, o in zip(widths[:-1], widths[1:], strict=True)]


def weight_bound(shape: tuple[int, int]) -> float:
    """Of the uniform distribution that weights start from (Glorot and Bengio 2010)."""
    return math.sqrt(6 / sum(shape))


def packed_networks(*nets: Sequence[Any]) -> list[Any]:
    """Networks for cooperative vectors, of the matrices (out, in) of each."""
    made = []
    for weights in nets:
        layers: list[Any] = []
        for weight in weights:
            linear: Any = nn.Linear(weight.shape[1], weight.shape[0], bias=False)
            linear.weights = weight
            layers += [linear, nn.ReLU()]
        made.append(nn.Sequential(*layers[:-1]))
    return list(nn.pack(*made))


def network_rows(net: Any, values: list[Any]) -> list[Any]:
    """Evaluates a network on N points: from its input channels, (N,) each, to its output channels.

    Args:
        net: its matrices (out, in), or one of `packed_networks`.
        values: input channels.
    """
    if isinstance(net, nn.Module):
        return list(net(nn.CoopVec(*values)))
    return unstacked(mlp.evaluate(net, stacked(values)))


def sigmoid(x: Any) -> Any:
    return 0.5 * dr.tanh(0.5 * x) + 0.5


def _softplus(x: Any) -> Any:
    return dr.maximum(x, 0) + dr.log(1 + dr.exp(-dr.abs(x)))
