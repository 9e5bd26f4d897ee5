"""Local coordinates of surface points in Dr.Jit, for networks that decode what is stored at vertices.

`mitex.methods.nca.decoder.coordinates` explains them, and has the same for torch.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from mitex.runtime.jit import dr, mi


@dataclass(frozen=True, eq=False)
class Waves:
    """Cosines of the position, in units of the edges around; between lengths of edges, the waves of the two
    nearest powers of two are mixed.

    Attributes:
        table: (N, 4): a wave's vector [cycles per edge] and its phase [cycles].
        amplitude: of the cosines.
    """

    table: np.ndarray
    amplitude: float

    def __call__(self, position: mi.Point3f, edge: mi.Float) -> list[mi.Float]:
        """N values at `position`, where edges are `edge` long, in the same units."""
        octave = dr.log2(edge)
        below = dr.floor(octave)
        share = octave - below
        mixed = [mi.Float(0)] * len(self.table)
        for level, weight in ((below, 1 - share), (below + 1, share)):
            place = mi.Vector3f(position) * dr.exp2(-level)
            factor = self.amplitude * dr.safe_sqrt(weight)
            for k, (x, y, z, phase) in enumerate(self.table.tolist()):
                cycles = dr.dot(place, mi.Vector3f(x, y, z)) + phase
                mixed[k] = dr.fma(factor, dr.cos(2 * dr.pi * cycles), mixed[k])
        return mixed


def sorted_barycentrics(barycentric: Sequence[mi.Float]) -> list[mi.Float]:
    """Sorted, each mapped through its distribution function to [-1, 1]."""
    a, b, c = barycentric
    low, high = dr.minimum(a, b), dr.maximum(a, b)
    largest, smallest = dr.maximum(high, c), dr.minimum(low, c)
    middle = dr.maximum(low, dr.minimum(high, c))
    shares = (
        dr.select(largest <= 0.5, 9 * dr.square(largest - 1 / 3), 1 - 3 * dr.square(1 - largest)),
        dr.select(middle <= 1 / 3, 6 * dr.square(middle), 1 - 12 * dr.square(0.5 - middle)),
        1 - 9 * dr.square(1 / 3 - smallest),
    )
    return [2 * share - 1 for share in shares]


def symmetric_polynomials(barycentric: Sequence[mi.Float]) -> list[mi.Float]:
    """6 (ab + bc + ca) - 1 and 54 abc - 1."""
    a, b, c = barycentric
    return [6 * (a * b + b * c + c * a) - 1, 54 * a * b * c - 1]


# What depends on the barycentric coordinates alone: how many numbers, and the function.
BARYCENTRIC: dict[str, tuple[int, Callable[[Sequence[mi.Float]], list[mi.Float]]]] = {
    "barycentrics": (3, sorted_barycentrics),
    "polynomials": (2, symmetric_polynomials),
}
