"""The permutation test over cases: against another implementation, and how often it takes chance for more."""

from itertools import combinations, product

import numpy as np
import pytest
import scipy.stats

from mitex.comparison.answers import Answer, evaluate
from mitex.comparison.permutation import permutation_p
from mitex.comparison.study import Question, Study

LEVEL = 0.05


def other_p(shares):
    """By scipy: all relabellings within cases; the statistic is F of the one-way analysis of variance."""

    def f(*columns, axis):
        return scipy.stats.f_oneway(*columns, axis=axis).statistic

    test = scipy.stats.permutation_test(
        tuple(shares.T), f, permutation_type="samples", n_resamples=10**6, alternative="greater"
    )
    return test.pvalue


@pytest.mark.parametrize(("cases", "methods"), [(3, 2), (8, 2), (4, 3), (2, 4)])
def test_it_is_scipys(cases, methods):
    shares = np.random.default_rng(cases).random((cases, methods))
    shares -= shares.mean(1, keepdims=True)  # what one wins, others lose
    assert permutation_p(shares) == pytest.approx(other_p(shares), abs=1e-12)


def test_of_two_methods_it_flips_the_signs_of_differences():
    differences = np.array([0.5, -0.25, 1.0, 0.75, -0.125])
    flipped = np.abs([np.dot(signs, differences) for signs in product((-1, 1), repeat=5)])
    expected = np.mean(flipped >= abs(differences.sum()))
    shares = np.stack([0.5 + differences / 2, 0.5 - differences / 2], 1)
    assert permutation_p(shares) == expected


def test_a_method_that_is_not_in_a_case_is_not_swapped_there():
    """What is missing counts neither as a share nor as a place for one."""
    shares = np.array([[1.0, 0.0, np.nan], [0.75, 0.25, np.nan], [0.9, np.nan, 0.1]])
    assert permutation_p(shares) == 2 / 2**3
    assert permutation_p(np.vstack([shares, [np.nan, 0.6, np.nan]])) == 2 / 2**3
    assert permutation_p(np.empty((0, 2))) == permutation_p(np.full((4, 3), 0.5)) == 1


def test_draws_come_near_to_all_relabellings():
    """By the binomial spread of the draws; the same seed draws the same."""
    shares = np.random.default_rng(1).random((4, 3))
    exact, draws = permutation_p(shares, 6**4), 1000
    drawn = permutation_p(shares, draws)
    assert drawn == permutation_p(shares, draws) != permutation_p(shares, draws, seed=1)
    assert abs(drawn - exact) < 4 * np.sqrt(exact * (1 - exact) / draws)


def evaluated(methods, cases, people, generator, bias=0.5):
    """Of answers by chance, but that the first method is preferred with a probability."""
    pairs = list(combinations("abcd"[:methods], 2))
    questions = [Question("lava", str(k), pair) for k in range(cases) for pair in pairs]
    first = np.array([bias if "a" in question.methods else 0.5 for question in questions])
    choices = (generator.random((people, len(questions))) >= first).astype(int)
    answers = {
        str(k): [Answer(n, int(choice)) for n, choice in enumerate(row)] for k, row in enumerate(choices)
    }
    return evaluate(Study("x", tuple(questions)), answers)


@pytest.mark.parametrize(("methods", "cases", "studies"), [(2, 6, 200), (4, 12, 50)])
def test_chance_is_seldom_found_to_differ(methods, cases, studies):
    """As often as the level says, at most; analyses of variance find it two to four times as often."""
    generator = np.random.default_rng(0)
    done = [evaluated(methods, cases, 12, generator) for _ in range(studies)]
    most = LEVEL + 3 * np.sqrt(LEVEL * (1 - LEVEL) / studies)
    assert np.mean([one.p <= LEVEL for one in done]) < most
    assert np.mean([min(one.pairs.values()) <= LEVEL for one in done]) < most


def test_what_differs_is_found():
    generator = np.random.default_rng(0)
    done = [evaluated(3, 12, 12, generator, bias=0.75) for _ in range(5)]
    assert all(one.p < 0.01 for one in done)
    assert all(one.pairs["a", other] < LEVEL for one in done for other in "bc")
