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

from mitex.methods.nerf import mlp
from mitex.methods.nerf.config import NerfConfig
from mitex.runtime import load_mitsuba

mi: Any = load_mitsuba(needs_llvm=False)
import drjit as dr  # noqa: E402  (Mitsuba first: it decides which LLVM Dr.Jit opens)
import drjit.nn as nn  # noqa: E402
from drjit.hashgrid import HashGridEncoding  # noqa: E402

OCTAVES = 12  # of the signed distance
FINE = 2 * OCTAVES + 1
COARSE = 12  # of those, what the angles see
FEATURES, PHASES = 16, 8  # channels of f and of f-hat
CODE = 15  # what the density network tells that of the reflection
LAYERS = {  # widths, without biases
    "density": (FEATURES + FINE, 32, CODE + 1),
    "reflection": (CODE, 64, 64, 5),
    "theta": (FEATURES + COARSE, 16, 16, 1),
    "phi": (PHASES + COARSE, 16, 16, 1),
}
# Which matrix is the last of theta's.
ELEVATION = sum(len(LAYERS[name]) - 1 for name in ("density", "reflection", "theta")) - 1
HIGHEST = 15.0  # exponent of the density


@dataclass
class Reflection:
    """What the networks say of a point.

    Attributes:
        exponent: natural logarithm of the density [1 / scene units].
        diffuse: k_d, `mi.Color3f` in [0, 1].
        specular: k_s in [0, 1].
        glossiness: g, at least 1.
        theta, phi: elevation and azimuth of the fine normal in the frame of the face [rad], unbounded.
    """

    exponent: Any
    diffuse: Any
    specular: Any
    glossiness: Any
    theta: Any
    phi: Any

    @property
    def density(self) -> Any:
        return dr.exp(dr.minimum(self.exponent, HIGHEST))

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
        ratio = (config.finest / config.coarsest) ** (1 / (FEATURES // 2 - 1))
        phase_ratio = (config.finest / config.coarsest) ** (1 / (PHASES // 2 - 1))
        self.grids: list[Any] = [
            HashGridEncoding(
                mi.Float,
                3,
                n_levels=channels // 2,
                n_features_per_level=2,
                hashmap_size=2**config.table,
                base_resolution=config.coarsest,
                per_level_scale=scale,
                align_corners=True,
                init_scale=0.0,
            )
            for channels, scale in ((FEATURES, ratio), (PHASES, phase_ratio))
        ]

    @property
    def sizes(self) -> list[int]:
        """Lengths of the tables of f and f-hat."""
        return [grid.n_params for grid in self.grids]

    def levels(self, which: int) -> list[slice]:
        """Where the levels lie in a table, 0 of f or 1 of f-hat."""
        grid = self.grids[which]
        ends = [2 * grid.level_offset(level) for level in range(grid.n_levels + 1)]
        return [slice(a, b) for a, b in zip(ends[:-1], ends[1:], strict=True)]

    def __call__(self, which: int, foot: Any, table: Any) -> list[Any]:
        """Features at foot points, `mi.Point3f` in the cube: 0 for f (16 channels), 1 for f-hat (8)."""
        grid = self.grids[which]
        grid.data = table
        return list(grid(dr.clip(foot * 0.5 + 0.5, 0, 1)))  # beyond its unit cube the grid returns garbage


class Decoder:
    """The networks from features and signed distance to density and reflection.

    Args:
        weights: matrices (out, in) in the order of `LAYERS`, each a `mi.TensorXf`.
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
        exponent, *diffuse, specular, glossiness, theta, phi = run([*f], [*phase], embedded(distance))
        return Reflection(
            exponent,
            mi.Color3f(*(sigmoid(k) for k in diffuse)),
            sigmoid(specular),
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
        given = _stacked(f), _stacked(phase), _stacked(fine)
        return _rows(dr.custom(_Networks, *given, nets, learning, moving))

    def _net(self, name: str) -> Any:
        return self._packed.get(name, self.weights[name])


class _Networks(dr.CustomOp):
    """All four on N points: f (16, N), f-hat (8, N), the embedded distance (25, N) -> the 8 outputs, (8, N).

    Only where points move (`moving`) does the distance get a gradient.
    """

    def eval(self, f: Any, phase: Any, fine: Any, nets: list[list[Any]], learning: bool, moving: bool) -> Any:
        self.nets, self.learning, self.moving = [[w.torch() for w in net] for net in nets], learning, moving
        values = torch.cat([f.torch(), fine.torch()])
        phases = torch.cat([phase.torch(), values[FEATURES : FEATURES + COARSE]])
        first = mlp.forwards(self.nets[0], values)
        read = first[-1][1:], values[: FEATURES + COARSE], phases
        rest = [mlp.forwards(net, x) for net, x in zip(self.nets[1:], read, strict=True)]
        self.layers = [first, *rest]
        return mi.TensorXf(torch.cat([first[-1][:1], *(layers[-1] for layers in rest)]))

    def backward(self) -> None:
        gradient: Any = self.grad_out()
        exponent, *rest = gradient.torch().split([1, *(widths[-1] for widths in list(LAYERS.values())[1:])])
        known = (None, None) if self.moving else (FEATURES, PHASES)
        of_reflection, code = self._back(1, rest[0], None)
        of_theta, angle = self._back(2, rest[1], known[0])
        of_phi, phases = self._back(3, rest[2], known[1])
        of_density, values = self._back(0, torch.cat([exponent, code]), known[0])
        values[: len(angle)] += angle
        self.set_grad_in("f", mi.TensorXf(values[:FEATURES]))
        self.set_grad_in("phase", mi.TensorXf(phases[:PHASES]))
        if self.moving:
            values[FEATURES : FEATURES + COARSE] += phases[PHASES:]
            self.set_grad_in("fine", mi.TensorXf(values[FEATURES:]))
        if self.learning:
            found = of_density, of_reflection, of_theta, of_phi
            self.set_grad_in("nets", [[mi.TensorXf(weight) for weight in net] for net in found])

    def _back(
        self, net: int, gradient: torch.Tensor, inputs: int | None
    ) -> tuple[list[torch.Tensor], torch.Tensor]:
        return mlp.backwards(self.nets[net], self.layers[net], gradient, self.learning, inputs)

    def name(self) -> str:
        return "networks"


def embedded(distance: Any) -> list[Any]:
    """The signed distance itself, then its sine and cosine at 12 octaves from 1 rad per scene unit on."""
    values = [distance]
    for octave in range(OCTAVES):
        values += dr.sincos(distance * 2.0**octave)
    return values


def weight_shapes() -> list[tuple[int, int]]:
    """(out, in) of each matrix, in the order of `LAYERS`."""
    return [(o, i) for widths in LAYERS.values() for i, o in zip(widths[:-1], widths[1:], strict=True)]


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
    return _rows(mlp.evaluate(net, _stacked(values)))


# Slices of tensors would have N as a literal, and so would need new kernels for each N. An opaque N does not.
def _stacked(values: list[Any]) -> Any:
    count = max(dr.width(value) for value in values)
    flat = dr.zeros(mi.Float, count * len(values))
    for k, value in enumerate(values):
        wide = value if dr.width(value) == count else mi.Float(value) + dr.zeros(mi.Float, count)
        dr.scatter(flat, wide, _places(k, count), mode=dr.ReduceMode.Permute)
    return mi.TensorXf(flat, (len(values), count))


def _rows(tensor: Any) -> list[Any]:
    rows, count = tensor.shape
    places = [_places(k, count) for k in range(rows)]
    return [dr.gather(mi.Float, tensor.array, place, mode=dr.ReduceMode.Permute) for place in places]


def _places(k: int, count: int) -> Any:
    return dr.arange(mi.UInt32, count) + dr.opaque(mi.UInt32, k * count)


def sigmoid(x: Any) -> Any:
    return 0.5 * dr.tanh(0.5 * x) + 0.5


def _softplus(x: Any) -> Any:
    return dr.maximum(x, 0) + dr.log(1 + dr.exp(-dr.abs(x)))
