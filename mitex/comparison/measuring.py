"""Measuring what a comparison's jobs have made, pair by pair: what one is measured with is large."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from mitex.comparison.inputs import forget
from mitex.comparison.kept import Kept
from mitex.comparison.kinds import Pair
from mitex.comparison.results import Result
from mitex.errors import MitexError, OutputError
from mitex.progress import announce


@dataclass
class Measurements:
    """What is known of results.

    Attributes:
        known: id of a result -> itself, with its numbers and pictures.
        exemplars: path, name or words -> picture (S, S, 3), sRGB in [0, 1]; None without one.
        floors: exemplar and mesh -> measure -> value of the exemplar beside itself.
        failures: a line for each result that cannot be measured.
        judge: name of the model that judged; None where there is no choice.
    """

    known: dict[str, Result] = field(default_factory=dict)
    exemplars: dict[str, np.ndarray | None] = field(default_factory=dict)
    floors: dict[tuple[str, str | None], dict[str, float]] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    judge: str | None = None


def measure(
    results: Sequence[Result], pair_of: Callable[[str, str | None], Pair], kept: Kept
) -> Measurements:
    """Measures what was not measured before; a result that cannot be is a failure of its own.

    Args:
        results: without numbers, as the jobs have made them.
        pair_of: exemplar and mesh -> what results are measured with.
        kept: what was measured before.

    Raises:
        OutputError: The disk is full.
    """
    forget()
    measurements = Measurements()
    for names in dict.fromkeys(result.pair for result in results):
        _measure_pair(names, results, pair_of, kept, measurements)
    return measurements


def _measure_pair(
    names: tuple[str, str | None],
    results: Sequence[Result],
    pair_of: Callable[[str, str | None], Pair],
    kept: Kept,
    measurements: Measurements,
) -> None:
    pair, complete = None, {}
    for result in (result for result in results if result.pair == names):
        announce(
            "measuring", len(measurements.known) + len(complete) + len(measurements.failures), len(results)
        )
        try:
            pair = pair or pair_of(*names)
            complete[result.id] = kept.completed(result, pair) or kept.measured(result, pair)
        except OutputError:
            raise
        except MitexError as e:
            measurements.failures.append(f"{result.id.rpartition('-')[0]} cannot be measured: {e}")
    if pair is not None and complete:
        measurements.known.update(complete)
        measurements.judge = pair.judge
        measurements.floors[names] = kept.floor(pair)
        if names[0] not in measurements.exemplars:
            measurements.exemplars[names[0]] = pair.image
