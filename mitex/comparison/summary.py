"""Means over seeds, their spread, and which method is the best where that is certain."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from mitex.comparison.measures import Measure
from mitex.comparison.results import Result


@dataclass(frozen=True)
class Cell:
    """A measure of a method.

    Attributes:
        mean: over seeds.
        spread: standard deviation over seeds; NaN of a single one.
        count: of the seeds.
        distance, distance_spread: the same of the distances of values from the best one that is possible, in
            which opposite errors do not cancel; NaN where no value is better.
        best: whether no other method comes within the spread of distances.
    """

    mean: float
    spread: float
    count: int
    distance: float = math.nan
    distance_spread: float = math.nan
    best: bool = False


@dataclass(frozen=True)
class Summary:
    """A table: methods by measures.

    Attributes:
        pair: exemplar and mesh, or None for what was put on no mesh; None for means over all pairs.
        methods: labels, in the plan's order.
        measures: the columns.
        cells: (method, measure's key) -> cell; without those that were not measured.
    """

    pair: tuple[str, str | None] | None
    methods: tuple[str, ...]
    measures: tuple[Measure, ...]
    cells: dict[tuple[str, str], Cell]


def summaries(results: Sequence[Result], measures: tuple[Measure, ...]) -> list[Summary]:
    """The tables of all pairs, then, if there are several, that of the means over pairs.

    What was put on no mesh stands beside the others on each mesh.
    """
    pairs = _pairs(results)
    tables = [_summary(pair, [r for r in results if _is_of(r, pair)], 1, measures) for pair in pairs]
    everything = [result for result in results for pair in pairs if _is_of(result, pair)]
    return [*tables, _summary(None, everything, len(pairs), measures)] if len(pairs) > 1 else tables


def _pairs(results: Sequence[Result]) -> list[tuple[str, str | None]]:
    """The pairs of results; an exemplar without a mesh only if no result of it is on one."""
    pairs = dict.fromkeys(result.pair for result in results)
    on_meshes = {exemplar for exemplar, mesh in pairs if mesh is not None}
    return [pair for pair in pairs if pair[1] is not None or pair[0] not in on_meshes]


def _is_of(result: Result, pair: tuple[str, str | None]) -> bool:
    """Whether a result is of a pair, or of its exemplar on no mesh."""
    return result.exemplar == pair[0] and result.mesh in (pair[1], None)


def _summary(
    pair: tuple[str, str | None] | None, results: Sequence[Result], pairs: int, measures: tuple[Measure, ...]
) -> Summary:
    """Over seeds, the means over pairs; only seeds with which a method has done all pairs count."""
    methods = tuple(dict.fromkeys(result.method for result in results))
    cells = {}
    for method in methods:
        for measure in measures:
            by_seed: dict[int | None, list[float]] = {}
            for r in results:
                if r.method == method and measure.key in r.numbers:
                    by_seed.setdefault(r.seed, []).append(r.numbers[measure.key])
            values = [of_seed for of_seed in by_seed.values() if len(of_seed) == pairs]
            if values:
                cells[method, measure.key] = _cell(measure, values)
    return Summary(pair, methods, measures, _marked(cells, methods, measures))


def _cell(measure: Measure, values: Sequence[Sequence[float]]) -> Cell:
    """Of the values of all pairs, for each seed."""
    cell = Cell(*mean_and_spread(values), len(values))
    if measure.distance is None:
        return cell
    distance, spread = mean_and_spread([[measure.distance(value) for value in one] for one in values])
    return replace(cell, distance=distance, distance_spread=spread)


def mean_and_spread(values: Sequence[Sequence[float]]) -> tuple[float, float]:
    """Of the values of all pairs, for each seed: the mean, and the standard deviation of the seeds' means.

    The deviation is NaN of a single seed.
    """
    means = [float(np.mean(one)) for one in values]
    return float(np.mean(means)), float(np.std(means, ddof=1)) if len(means) > 1 else math.nan


def _marked(
    cells: dict[tuple[str, str], Cell], methods: Sequence[str], measures: Sequence[Measure]
) -> dict[tuple[str, str], Cell]:
    """The cells, of which the best one of each measure says so, where that is certain."""
    marked = dict(cells)
    for measure in measures:
        of_methods = {
            method: cells[method, measure.key] for method in methods if (method, measure.key) in cells
        }
        if winner := best(measure, of_methods):
            marked[winner, measure.key] = replace(cells[winner, measure.key], best=True)
    return marked


def best(measure: Measure, cells: dict[str, Cell]) -> str | None:
    """The method that is better than each other one by more than both spreads together, if there is one.

    Better is what is less far from the best value on average. A single seed has no spread, so that nothing is
    certain.
    """
    if measure.distance is None or len(cells) < 2:
        return None
    first, *others = sorted(cells, key=lambda method: cells[method].distance)
    for other in others:
        spreads = cells[first].distance_spread + cells[other].distance_spread
        if not cells[other].distance - cells[first].distance > spreads:
            return None
    return first
