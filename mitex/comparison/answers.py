"""What people answered in a blind test: how often each method was preferred, and whether that is chance.

As in the study of Kovacs et al. (2024): the share of answers that prefer a method, its mean and standard
deviation over the cases, which are pairs of exemplar and mesh, and an analysis of variance over the methods
with the cases as blocks (repeated measures). It takes shares as normally distributed; a permutation test over
the cases does without, and stands in place of the paper's t-tests of two methods each.
"""

from __future__ import annotations

import json
import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from itertools import combinations
from pathlib import Path
from typing import Any

import numpy as np
import scipy.stats

from mitex.comparison.permutation import permutation_p
from mitex.comparison.study import Study
from mitex.errors import ConfigError
from mitex.paths import expanded
from mitex.reading import content

MOST_BYTES = 1 << 20  # of a file of answers


@dataclass(frozen=True)
class Answer:
    """A person's answer to a question.

    Attributes:
        question: its number in the study.
        choice: 0 or 1, of the question's methods; None if they look alike.
    """

    question: int
    choice: int | None


@dataclass(frozen=True)
class Preference:
    """How often a method was preferred.

    Attributes:
        method: its label.
        wins: answers that prefer it; half of one where no difference was seen.
        count: answers to questions about it.
        interval: of the share, 95 %, Wilson's, if answers were independent.
        mean, spread: of the shares in the cases, and their standard deviation; NaN of a single case.
    """

    method: str
    wins: float
    count: int
    interval: tuple[float, float]
    mean: float
    spread: float

    @property
    def share(self) -> float:
        """Of the answers."""
        return self.wins / self.count


@dataclass(frozen=True)
class Evaluation:
    """The outcome of a study.

    Attributes:
        preferences: the most preferred method first.
        p: of the permutation test over cases, that methods are alike; NaN of fewer than two methods.
        pairs: two methods -> p of the same test of the cases that both are in, adjusted by Holm's procedure.
        f, published_p: of the analysis of variance over methods with the cases as blocks, as published, of
            the cases that all tested methods are in; NaN where it cannot be told.
        untested: methods that were asked about in a single case, which the tests leave out.
        people: whose answers there are.
    """

    preferences: tuple[Preference, ...]
    p: float
    pairs: Mapping[tuple[str, str], float]
    f: float
    published_p: float
    untested: tuple[str, ...]
    people: int

    def text(self) -> str:
        """A line for each method, then the tests."""
        lines = [f"answers of {self.people} {'person' if self.people == 1 else 'people'}"]
        width = max(len(one.method) for one in self.preferences)
        for one in self.preferences:
            low, high = (100 * bound for bound in one.interval)
            spread = (
                ""
                if math.isnan(one.spread)
                else f"; over cases {_percent(one.mean)} ± {_percent(one.spread)}"
            )
            share = f"{_percent(one.share)} (95 %: {low:.0f} to {high:.0f} %)"
            lines.append(f"{one.method:{width}}  {share} of {one.count}{spread}")
        if math.isnan(self.p):
            return "\n".join([*lines, "permutation test: needs two methods in two cases"])
        if self.untested:
            lines.append(f"of a single case, and not tested: {', '.join(self.untested)}")
        lines.append(f"permutation test over cases: p = {self.p:.2g}")
        if len(self.preferences) - len(self.untested) > 2:  # of two the whole is the pair
            lines += [f"{one} and {other}: p = {p:.2g}" for (one, other), p in self.pairs.items()]
        if not math.isnan(self.published_p):
            published = f"F = {self.f:.3f}, p = {self.published_p:.2g}"
            lines.append(f"analysis of variance as published, cases as blocks: {published}")
        return "\n".join(lines)


def read_answers(study: Study, files: Iterable[str | Path]) -> dict[str, list[Answer]]:
    """The answers in files that the page saved: a person's random id, as the page has made it -> answers.

    Raises:
        ConfigError: A file cannot be read, is of another study, answers a question twice, or is the same
            person's as another.
    """
    people: dict[str, list[Answer]] = {}
    for file in files:
        id, answers = _read(study, expanded(file))
        if id in people:
            raise ConfigError(f"the answers in '{file}' are there twice", "name every file once")
        people[id] = answers
    if not any(people.values()):
        raise ConfigError("there are no answers", "name files that the study's page has saved")
    return people


def evaluate(study: Study, people: Mapping[str, Sequence[Answer]]) -> Evaluation:
    """Shares, their spread over the cases, and the tests."""
    methods, wins, counts = _tally(study, [answer for answers in people.values() for answer in answers])
    shares = np.divide(wins, counts, out=np.full_like(wins, math.nan), where=counts > 0)
    preferences = list(map(_preference, methods, shares.T, wins.sum(0), counts.sum(0)))
    is_tested = (counts > 0).sum(0) > 1  # in several cases
    untested = tuple(m for m, tested in zip(methods, is_tested, strict=True) if not tested)
    by_share = sorted(preferences, key=lambda one: -one.share)
    p, pairs = _tests([m for m in methods if m not in untested], shares[:, is_tested])
    return Evaluation(tuple(by_share), p, pairs, *blocked_anova(shares[:, is_tested]), untested, len(people))


def _tally(study: Study, answers: Sequence[Answer]) -> tuple[list[str], np.ndarray, np.ndarray]:
    """The methods, and (C, M) how often each won in each case, and how often it was asked about there."""
    questions = [study.questions[answer.question] for answer in answers]
    methods = list(dict.fromkeys(method for question in questions for method in question.methods))
    cases = list(dict.fromkeys((question.exemplar, question.mesh) for question in questions))
    wins, counts = np.zeros((2, len(cases), len(methods)))
    for answer, question in zip(answers, questions, strict=True):
        case = cases.index((question.exemplar, question.mesh))
        for k, method in enumerate(question.methods):
            cell = case, methods.index(method)
            counts[cell] += 1
            wins[cell] += 0.5 if answer.choice is None else answer.choice == k
    return methods, wins, counts


def _read(study: Study, file: Path) -> tuple[str, list[Answer]]:
    """A person's id and answers."""
    try:
        record = json.loads(content(file, MOST_BYTES))
        if record["study"] != study.id:
            raise ConfigError(f"'{file}' answers another study", "name answers to this one")
        id, answers = str(record["participant"]), [_answer(study, entry) for entry in record["answers"]]
    except (OSError, ValueError, TypeError, KeyError, IndexError, RecursionError) as e:
        raise ConfigError(f"'{file}' holds no answers", "name a file that the study's page has saved") from e
    if len({answer.question for answer in answers}) < len(answers):
        raise ConfigError(f"'{file}' answers a question twice", "name one that the study's page has saved")
    return id, answers


def _answer(study: Study, entry: Mapping[str, Any]) -> Answer:
    question, choice = entry["question"], entry["choice"]
    if type(question) is not int or not 0 <= question < len(study.questions) or choice not in (0, 1, None):
        raise ValueError(entry)
    return Answer(question, choice)


def _preference(method: str, shares: np.ndarray, wins: float, count: float) -> Preference:
    """Of shares (C,) in the cases, NaN where a method was not asked about, and sums over them."""
    known = shares[~np.isnan(shares)]
    spread = float(np.std(known, ddof=1)) if len(known) > 1 else math.nan
    interval = wilson_interval(float(wins / count), int(count))
    return Preference(method, float(wins), int(count), interval, float(np.mean(known)), spread)


def wilson_interval(share: float, count: int) -> tuple[float, float]:
    """The 95 % interval of a probability in [0, 1] of which a share of `count` trials was seen (Wilson 1927).

    The share may count trials by halves.
    """
    z = float(scipy.stats.norm.ppf(0.975))
    middle = share + z * z / (2 * count)
    reach = z * math.sqrt(share * (1 - share) / count + z * z / (4 * count * count))
    low, high = ((middle + sign * reach) / (1 + z * z / count) for sign in (-1, 1))
    return max(low, 0.0), min(high, 1.0)


def _tests(methods: Sequence[str], shares: np.ndarray) -> tuple[float, dict[tuple[str, str], float]]:
    """p of all methods (M,) by their shares (C, M), NaN of fewer than two, and the adjusted p of each two."""
    if len(methods) < 2:
        return math.nan, {}
    raw = {}
    for one, other in combinations(range(len(methods)), 2):
        both = shares[:, [one, other]]
        raw[methods[one], methods[other]] = permutation_p(both[~np.isnan(both).any(1)])
    return permutation_p(shares), holm(raw)


def blocked_anova(shares: np.ndarray) -> tuple[float, float]:
    """F and p of the analysis of variance of repeated measures: methods, with the cases as blocks.

    Args:
        shares: (C, M), NaN where a method was not asked about; cases with such are left out.

    Returns:
        F of M - 1 and (C - 1)(M - 1) degrees of freedom, and its p; both NaN of fewer than two cases or
        methods, or if all cases differ alike.
    """
    shares = shares[~np.isnan(shares).any(1)]
    cases, methods = shares.shape
    if min(cases, methods) < 2:
        return math.nan, math.nan
    within = shares - shares.mean(1, keepdims=True)
    effects = within.mean(0)
    residuals = within - effects
    if np.allclose(residuals, 0, atol=1e-12):
        return math.nan, math.nan
    between, rest = methods - 1, (cases - 1) * (methods - 1)
    f = cases * np.sum(effects**2) / between / (np.sum(residuals**2) / rest)
    return float(f), float(scipy.stats.f.sf(f, between, rest))


def holm(raw: Mapping[tuple[str, str], float]) -> dict[tuple[str, str], float]:
    """p values, adjusted for how many tests there are (Holm 1979).

    The least is multiplied by the number of tests, the next one by one less, and so on; none becomes less
    than the one before, nor more than 1.
    """
    adjusted, least = {}, 0.0
    for k, pair in enumerate(sorted(raw, key=lambda pair: raw[pair])):
        least = max(least, min(raw[pair] * (len(raw) - k), 1.0))
        adjusted[pair] = least
    return adjusted


def _percent(share: float) -> str:
    return f"{100 * share:.1f} %"
