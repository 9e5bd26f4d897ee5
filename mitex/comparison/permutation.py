"""A test of whether methods differ that holds for shares which are bound together within each case."""

from __future__ import annotations

import math
from collections.abc import Sequence
from itertools import permutations

import numpy as np

DRAWS = 10_000  # relabellings that are looked at: all of them, or as many at random
TOLERANCE = 1e-9  # relative; sums in another order are equal


def permutation_p(shares: np.ndarray, draws: int = DRAWS, seed: int = 0) -> float:
    """p that methods are alike: how often methods whose names are swapped within cases differ as much.

    The permutation test of Pitman (1938) for randomised blocks, here the cases. Shares less the mean of their
    case are summed over the cases of each method; the statistic is the sum over methods of the square of that
    over the number of cases. Of complete cases it orders relabellings as F of the analysis of variance with
    cases as blocks does; of two methods it is the sign test of Fisher (1935) with the sizes of differences.

    Args:
        shares: (C, M) of C cases and M methods in [0, 1]; NaN where a method has no answers in a case.
        draws: if there are more relabellings, this many are drawn, and the observed one counts as one more
            (Phipson and Smyth 2010).
        seed: of the draws.

    Returns:
        In (0, 1]; 1 where nothing differs.
    """
    rows = [_centred(row) for row in shares]
    cases = np.maximum((~np.isnan(shares)).sum(0), 1)
    if math.prod(math.factorial(len(places)) for places, _ in rows) <= draws:
        return float(_is_extreme(_all_totals(rows, len(cases)), rows, cases).mean())
    totals = _random_totals(rows, len(cases), draws, np.random.default_rng(seed))
    return float((_is_extreme(totals, rows, cases).sum() + 1) / (draws + 1))


Row = tuple[np.ndarray, np.ndarray]  # methods (k,) of a case, and their shares (k,) less their mean


def _centred(row: np.ndarray) -> Row:
    places = np.flatnonzero(~np.isnan(row))
    return places, row[places] - (row[places].mean() if len(places) else 0.0)


def _is_extreme(totals: np.ndarray, rows: Sequence[Row], cases: np.ndarray) -> np.ndarray:
    """(N,) bool: which sums (N, M) differ at least as much as the observed ones."""
    observed = np.zeros(len(cases))
    for places, values in rows:
        observed[places] += values
    return (totals**2 / cases).sum(1) >= (observed**2 / cases).sum() * (1 - TOLERANCE)


def _all_totals(rows: Sequence[Row], methods: int) -> np.ndarray:
    """(N, M) sums over cases, for every relabelling."""
    totals = np.zeros((1, methods))
    for places, values in rows:
        own = np.zeros((math.factorial(len(places)), methods))
        own[:, places] = list(permutations(values))
        totals = (totals[:, None] + own).reshape(-1, methods)
    return totals


def _random_totals(
    rows: Sequence[Row], methods: int, draws: int, generator: np.random.Generator
) -> np.ndarray:
    """(N, M) sums over cases, for relabellings drawn at random."""
    totals = np.zeros((draws, methods))
    for places, values in rows:
        totals[:, places] += generator.permuted(np.tile(values, (draws, 1)), axis=1)
    return totals
