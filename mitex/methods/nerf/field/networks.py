"""The networks from features and signed distance to density and reflection, as one operation run by torch."""

from __future__ import annotations

from collections.abc import Iterator, Mapping

import torch
from torch.nn import functional as F

from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field import mlp
from mitex.methods.nerf.field.tensors import as_torch
from mitex.runtime.jit import dr, mi

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

# All inputs, in an order in which what a network reads is side by side: the octaves of the distance that the
# density alone sees, the others, f, f-hat.
BEYOND = FINE - COARSE
INPUTS = FINE + FEATURES + PHASES
READS = {"density": slice(0, INPUTS - PHASES), "angles": slice(BEYOND, INPUTS)}
PLACES = {  # in what is read, of a network's own inputs
    "density": [*range(FINE, FINE + FEATURES), *range(BEYOND, FINE), *range(BEYOND)],
    "theta": [*range(COARSE, COARSE + FEATURES), *range(COARSE)],
    "phi": [*range(COARSE + FEATURES, COARSE + FEATURES + PHASES), *range(COARSE)],
}
Nets = Mapping[str, mlp.Weights]


def weight_shapes(config: NerfConfig) -> list[tuple[int, int]]:
    """(out, in) of each matrix, in the order of `LAYERS`; settings say the density's width and `fresnel`."""
    layers = LAYERS | {"density": (FEATURES + FINE, config.density_width, CODE + 1)}
    if not config.fresnel:
        layers["reflection"] = (*LAYERS["reflection"][:-1], REFLECTION)
    return [(o, i) for widths in layers.values() for i, o in zip(widths[:-1], widths[1:], strict=True)]


class Networks(dr.CustomOp):
    """All four on N points: inputs (49, N) as above -> the outputs, (9, N) or, as published, (8, N).

    Those of theta and phi are run as one, "angles", with blocks of zeros: wider matrices are multiplied
    faster. Only where points move (`moving`) does the distance get a gradient. With `low_precision` and
    points that stay, gradients are multiplied in bfloat16 and summed in float32; outputs are exact.
    """

    def eval(
        self,
        values: mi.TensorXf,
        nets: list[list[mi.TensorXf]],
        learning: bool,
        moving: bool,
        low_precision: bool,
    ) -> mi.TensorXf:
        self.learning, self.values = learning, as_torch(values)
        self.first = 0 if moving else FINE  # of the inputs that get a gradient
        self.kind = torch.bfloat16 if low_precision and not moving else torch.float32
        self.nets = _join(*([as_torch(weight) for weight in net] for net in nets))
        count = self.values.shape[1]
        self.activations = {
            name: mlp.empty_activations(weights, count, self.kind) for name, weights in self.nets.items()
        }
        self.code = torch.empty(CODE + 1, count)
        results = torch.empty(sum(self._sizes), count)

        def work(parts: Iterator[slice]) -> None:
            for part in parts:
                exponent, *outputs = results[:, part].split(self._sizes)
                for name, out in zip(self.nets, [self.code[:, part], *outputs], strict=True):
                    values = self._inputs(name, self.values[:, part], part)
                    mlp.forwards(self.nets[name], values, self.activations[name], part, out)
                exponent.copy_(self.code[:1, part])

        mlp.on_threads(count, work, self.kind)
        return mi.TensorXf(results)

    def backward(self) -> None:
        of_results = as_torch(mi.TensorXf(self.grad_out()))
        of_values = torch.empty_like(self.values)
        of_values[: self.first] = 0
        kinds = {kind: self._of_kind(kind) for kind in (self.kind, torch.float32)}

        def work(parts: Iterator[slice]) -> list[list[torch.Tensor]]:
            totals = {k: [torch.zeros_like(w) for w in net if self.learning] for k, net in self.nets.items()}
            for part in parts:
                kind = mlp.kind_of(part, self.kind)
                of_values[self.first :, part] = self._flow(
                    part, of_results[:, part].to(kind), *kinds[kind], totals
                )
            return [*totals.values()]

        sums = mlp.on_threads(of_results.shape[1], work, self.kind)
        self.set_grad_in("values", mi.TensorXf(of_values))
        if self.learning:
            split = _split(*map(mlp.sum_over_threads, zip(*sums, strict=True)))
            self.set_grad_in("nets", [[mi.TensorXf(w.contiguous()) for w in net] for net in split])

    def _flow(
        self, part: slice, gradient: torch.Tensor, nets: Nets, firsts: torch.Tensor, sums: Nets
    ) -> torch.Tensor:
        """The gradient of a part's inputs, from that of its outputs; those of the weights are added up."""
        values = self.values[:, part].to(gradient.dtype)

        def back(name: str, gradient: torch.Tensor) -> torch.Tensor:
            inputs, activations = self._inputs(name, values, part), self.activations[name]
            return mlp.backwards(nets[name], inputs, activations, part, gradient, sums[name])

        exponent, reflection, angles = gradient.split(self._sizes)
        of_code = nets["reflection"][0].T @ back("reflection", reflection)
        of_code[:1] = exponent
        flows = torch.cat([back("density", of_code).T, back("angles", angles).T], 1)
        return firsts @ flows.T

    @property
    def _sizes(self) -> list[int]:
        """How many of the outputs are the exponent, the reflection, the angles."""
        return [1, len(self.nets["reflection"][-1]), len(self.nets["angles"][-1])]

    def _of_kind(self, kind: torch.dtype) -> tuple[Nets, torch.Tensor]:
        """The networks, and their first matrices transposed for the gradient of the inputs that get one."""
        nets = {name: [weight.to(kind) for weight in net] for name, net in self.nets.items()}
        return nets, _firsts(nets)[:, self.first :].T

    def _inputs(self, name: str, values: torch.Tensor, part: slice) -> torch.Tensor:
        return self.code[:, part].to(values.dtype) if name == "reflection" else values[READS[name]]

    def name(self) -> str:
        return "networks"


def _join(density: mlp.Weights, reflection: mlp.Weights, theta: mlp.Weights, phi: mlp.Weights) -> Nets:
    """The networks for inputs as above, each after those that it reads."""
    angles = torch.cat([_place_columns(theta[0], "theta", "angles"), _place_columns(phi[0], "phi", "angles")])
    return {
        "density": [_place_columns(density[0], "density", "density"), *density[1:]],
        # With a column of zeros for the exponent, 16 in all: products with 15 take three times as long.
        "reflection": [F.pad(reflection[0], (1, 0)), *reflection[1:]],
        "angles": [angles, *map(torch.block_diag, theta[1:], phi[1:])],
    }


def _firsts(nets: Nets) -> torch.Tensor:
    """The first matrices of those that read the inputs, of all inputs: one upon the other."""
    return torch.cat([F.pad(nets[name][0], (at.start, INPUTS - at.stop)) for name, at in READS.items()])


def _place_columns(weight: torch.Tensor, name: str, reader: str) -> torch.Tensor:
    """A first matrix with its columns at the places of the inputs."""
    wide = weight.new_zeros(len(weight), READS[reader].stop - READS[reader].start)
    wide[:, PLACES[name]] = weight
    return wide


def _split(density: mlp.Weights, reflection: mlp.Weights, angles: mlp.Weights) -> list[mlp.Weights]:
    """The four again, of what is joined."""
    (theta, phi), *blocks = (weights.chunk(2) for weights in angles)
    return [
        [density[0][:, PLACES["density"]], *density[1:]],
        [reflection[0][:, 1:], *reflection[1:]],
        [theta[:, PLACES["theta"]], *(upper.chunk(2, 1)[0] for upper, _ in blocks)],
        [phi[:, PLACES["phi"]], *(lower.chunk(2, 1)[1] for _, lower in blocks)],
    ]
