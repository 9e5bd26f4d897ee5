"""What a decoder is built from; light, for the settings."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

# Names of local coordinates and how many numbers they are; `waves` has as many as it has waves.
WIDTHS = {"barycentrics": 3, "polynomials": 2}
COORDINATES = ("waves", *WIDTHS)


@dataclass(frozen=True)
class DecoderShape:
    """The parts of a decoder.

    Attributes:
        interpolation: of the states between the vertices.
        coordinates: names of the local coordinates, of `COORDINATES`.
        waves: number of waves of the solid noise.
        frequencies: of the waves, in turns [cycles per edge].
        amplitude: of the waves.
        width, depth: of the network's hidden layers.
        omega: factor in its sines.
    """

    interpolation: Literal["smooth", "linear"] = "smooth"
    coordinates: tuple[str, ...] = ("waves",)
    waves: int = 12
    frequencies: tuple[float, ...] = (1.7, 2.3, 3.1)
    amplitude: float = 0.3
    width: int = 32
    depth: int = 3
    omega: float = 10.0

    @property
    def extra(self) -> int:
        """How many numbers the local coordinates are."""
        return sum(WIDTHS.get(name, self.waves) for name in self.coordinates)
