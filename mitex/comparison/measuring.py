"""Measuring the results of a comparison's jobs pair by pair, since what a pair is measured with is large."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field

import numpy as np

from mitex.comparison.inputs import forget
from mitex.comparison.kinds import Pair
from mitex.comparison.results import Result
from mitex.comparison.store import Store
from mitex.errors import MitexError, OutputError
from mitex.progress import announce


@dataclass
class Measurements:
    """What is measured of results.

    Attributes:
        results: id of a result -> itself, with its numbers and pictures.
        exemplars: path, name or words -> picture (S, S, 3), sRGB in [0, 1]; None without one.
        floors: exemplar and mesh -> measure -> value of the exemplar beside itself.
        failures: a line for each result that cannot be measured.
        judge: name of the model that judged; None where there is no choice.
    """

    results: dict[str, Result] = field(default_factory=dict)
    exemplars: dict[str, np.ndarray | None] = field(default_factory=dict)
    floors: dict[tuple[str, str | None], dict[str, float]] = field(default_factory=dict)
    failures: list[str] = field(default_factory=list)
    judge: str | None = None


def measure(
    results: Sequence[Result], pair_of: Callable[[str, str | None], Pair], store: Store
) -> Measurements:
    """Measures what the store does not have; a result that cannot be measured is a failure of its own.

    Args:
        results: of the jobs, without numbers.
        pair_of: exemplar and mesh -> what results are measured with.
        store: has what was measured before, and gets the rest.

    Raises:
        OutputError: The disk is full.
    """
    forget()
    measurements = Measurements()
    for names in dict.fromkeys(result.pair for result in results):
        _measure_pair(names, results, pair_of, store, measurements)
    return measurements


def _measure_pair(
    names: tuple[str, str | None],
    results: Sequence[Result],
    pair_of: Callable[[str, str | None], Pair],
    store: Store,
    measurements: Measurements,
) -> None:
    """Adds the measurements of a pair's results to the others; nothing of the pair is kept in memory."""
    pair, of_pair = None, {}
    for result in (result for result in results if result.pair == names):
        count = len(measurements.results) + len(of_pair) + len(measurements.failures)
        announce("measuring", count, len(results))
        try:
            pair = pair or pair_of(*names)
            of_pair[result.id] = store.load(result, pair) or store.measure(result, pair)
        except OutputError:
            raise
        except MitexError as e:
            measurements.failures.append(f"{result.id.rpartition('-')[0]} cannot be measured: {e}")
    if pair is not None and of_pair:
        measurements.results.update(of_pair)
        measurements.judge = pair.judge
        measurements.floors[names] = store.floor(pair)
        if names[0] not in measurements.exemplars:
            measurements.exemplars[names[0]] = pair.image
