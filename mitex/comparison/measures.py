"""What is measured of each result: names, units, which way better lies, and what the numbers mean."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass


@dataclass(frozen=True)
class Measure:
    """A number that results have.

    Attributes:
        key: in tables and files.
        label: over a column.
        better: which way better lies, in words; "" for what is neither good nor bad.
        meaning: a sentence or two.
        distance: from the best that is possible, to compare two values by; None if neither is better.
        scale: factor of the value in the report; files have the value itself.
    """

    key: str
    label: str
    better: str
    meaning: str
    distance: Callable[[float], float] | None = abs
    scale: float = 1.0


def _off_one(value: float) -> float:
    return abs(value - 1)


LOWER, TO_ZERO, TO_ONE = "low is better", "best is 0", "best is 1"

MEASURES = (
    Measure(
        "frechet_fine",
        "Fréchet, fine",
        LOWER,
        "Fréchet distance between the features of patches of the surface and of the exemplar at relu2_2 of "
        "VGG-16, taken as Gaussians: strokes, grain, colours.",
    ),
    Measure(
        "frechet_coarse",
        "Fréchet, coarse",
        LOWER,
        "The same at relu4_1, whose features see 40 pixels and more: shapes and how they are arranged.",
    ),
    Measure(
        "transport",
        "Transport",
        LOWER,
        "Relaxed optimal transport (MeshNCA, equation 4) between the features of five layers of VGG-16: "
        "whether each detail of one has its like in the other. nca trains with it.",
    ),
    Measure(
        "gram",
        "Gram",
        LOWER,
        "Squared distance of the Gram matrices of five layers of VGG-16. surface, gatys, multi_view_gram and "
        "reaction_diffusion train with it.",
    ),
    Measure(
        "seams",
        "Seam ratio",
        TO_ONE,
        "How much more the colours change across the seams of the UV layout than across other edges of the "
        "mesh. 1: seams cannot be seen. No network is involved.",
        _off_one,
    ),
    Measure(
        "repetition",
        "Repetition",
        TO_ZERO,
        "The highest peak of the autocorrelation beside the one at no shift, minus that of the exemplar. "
        "Above 0: it repeats more than the exemplar; below: it is less regular. No network is involved.",
    ),
    Measure(
        "parameters",
        "Parameters",
        "",
        "Numbers that the fit optimizes: weights of a network, or texels. 0 where nothing is optimized.",
        None,
    ),
    Measure("fit_seconds", "Fit [s]", LOWER, "Wall time of the fit, with the start of its process."),
    Measure(
        "apply_seconds",
        "Synthesis [s]",
        LOWER,
        "Wall time of `mitex apply`: putting it on the mesh and writing the file. Methods that fit to one "
        "mesh synthesize in the fit.",
    ),
    Measure(
        "memory",
        "Memory [GB]",
        LOWER,
        "The most memory that the process of the fit or that of the synthesis had.",
        scale=1e-9,
    ),
)
BY_KEY = {measure.key: measure for measure in MEASURES}
