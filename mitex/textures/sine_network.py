"""A small sine network, evaluated for each sample inside a kernel."""

from __future__ import annotations

from collections.abc import Sequence

from mitex.errors import ConfigError
from mitex.runtime.jit import dr, mi


class SineNetwork:
    """Layers sin(omega (W x + b)), then a linear one (Sitzmann et al. 2020).

    Cooperative vectors keep the kernel small: unrolled, a network of 32 x 32 takes seconds to compile.

    Args:
        weights: W of each layer, (outputs, inputs).
        biases: b of each layer, (outputs,).
        omega: the factor.

    Raises:
        ConfigError: the shapes do not fit each other.
    """

    def __init__(
        self, weights: Sequence[mi.TensorXf], biases: Sequence[mi.TensorXf], omega: float = 10.0
    ) -> None:
        self.weights, self.biases, self.omega = list(weights), list(biases), omega
        self.check()

    @property
    def inputs(self) -> int:
        """How many numbers the network is given."""
        return self.weights[0].shape[1]

    @property
    def outputs(self) -> int:
        """How many numbers it gives."""
        return self.weights[-1].shape[0]

    def check(self) -> None:
        """Raises a ConfigError if a layer does not fit the one before or its bias; evaluates the weights."""
        if not self.weights or len(self.weights) != len(self.biases):
            raise ConfigError(
                f"{len(self.weights)} weights and {len(self.biases)} biases", "give pairs of both"
            )
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            if weight.ndim != 2 or 0 in weight.shape:
                raise ConfigError(
                    f"'weight_{k}' has shape {weight.shape}", "give one of shape (outputs, inputs)"
                )
            if bias.shape != weight.shape[:1]:
                raise ConfigError(f"'bias_{k}' has shape {bias.shape}", f"give {weight.shape[:1]}")
            if k and weight.shape[1] != self.weights[k - 1].shape[0]:
                width = self.weights[k - 1].shape[0]
                raise ConfigError(
                    f"'weight_{k}' has {weight.shape[1]} inputs, but the layer before gives {width}",
                    "give it as many inputs",
                )
        dr.eval(self.weights, self.biases)

    def __call__(self, values: Sequence[mi.Float]) -> list[mi.Float]:
        """The outputs for the inputs `values`."""
        x = dr.nn.CoopVec(*values)
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            x = dr.nn.matvec(dr.nn.view(weight), x, dr.nn.view(bias))
            if k + 1 < len(self.weights):
                x = dr.nn.CoopVec(*[dr.sin(self.omega * v) for v in x])
        return list(x)

    def slopes(
        self, values: Sequence[mi.Float], tangents: Sequence[Sequence[mi.Float]]
    ) -> list[list[mi.Float]]:
        """Derivatives of the outputs along each of the `tangents` of the inputs `values`."""
        x, ways = dr.nn.CoopVec(*values), [dr.nn.CoopVec(*tangent) for tangent in tangents]
        for k, (weight, bias) in enumerate(zip(self.weights, self.biases, strict=True)):
            ways = [dr.nn.matvec(dr.nn.view(weight), way) for way in ways]
            if k + 1 == len(self.weights):
                break
            angles = [self.omega * v for v in dr.nn.matvec(dr.nn.view(weight), x, dr.nn.view(bias))]
            cosines = [self.omega * dr.cos(angle) for angle in angles]
            x = dr.nn.CoopVec(*[dr.sin(angle) for angle in angles])
            ways = [dr.nn.CoopVec(*[c * v for c, v in zip(cosines, way, strict=True)]) for way in ways]
        return [list(way) for way in ways]
