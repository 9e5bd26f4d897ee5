"""Means, spreads, and what is marked as the best."""

import math
from pathlib import Path

import pytest

from mitex.comparison import summary
from mitex.comparison.measures import BY_KEY, COSTS, LOOKS
from mitex.comparison.results import Result
from mitex.comparison.summary import Cell, best
from mitex.comparison.tables import table_html


def result(method, seed, mesh: str | None = "ball", **numbers):
    return Result(f"{method}-{seed}-{mesh}", "lava", mesh, method, seed, Path("a"), Path("b"), numbers)


def summaries(results):
    return summary.summaries(results, (*LOOKS, *COSTS))


def test_mean_and_spread_over_seeds():
    (table,) = summaries([result("a", k, gram=value) for k, value in enumerate((1.0, 2.0, 6.0))])
    cell = table.cells["a", "gram"]
    assert (cell.mean, cell.count) == (3.0, 3)
    assert cell.spread == pytest.approx(math.sqrt(7))  # (4 + 1 + 9) / (3 - 1)
    assert ("a", "transport") not in table.cells


def test_the_overall_spread_is_that_of_means_over_pairs():
    """Pairs differ far more than seeds: that is no spread. Seeds that lack a pair do not count."""
    numbers = {("ball", 0): 1.0, ("vase", 0): 101.0, ("ball", 1): 3.0, ("vase", 1): 103.0, ("ball", 2): 900.0}
    tables = summaries([result("a", seed, mesh, gram=v) for (mesh, seed), v in numbers.items()])
    assert [table.pair for table in tables] == [("lava", "ball"), ("lava", "vase"), None]
    cell = tables[-1].cells["a", "gram"]
    assert (cell.mean, cell.count) == (52.0, 2)
    assert cell.spread == pytest.approx(math.sqrt(2))


def test_what_is_put_on_no_mesh_stands_beside_the_others_on_each():
    """And counts as done on all of them; alone, it has a table of its own."""
    plain = result("b", 0, None, gram=5.0)
    others = [result("a", 0, mesh, gram=value) for mesh, value in (("ball", 1.0), ("vase", 3.0))]
    tables = summaries([*others, plain])
    assert [table.pair for table in tables] == [("lava", "ball"), ("lava", "vase"), None]
    means = [[table.cells[name, "gram"].mean for name in "ab"] for table in tables]
    assert means == [[1, 5], [3, 5], [2, 5]]
    assert summaries([others[1], *others, plain])[-1].methods == ("a", "b")
    (alone,) = summaries([plain])
    assert alone.pair == ("lava", None) and alone.cells["b", "gram"].mean == 5


def test_a_distance_is_the_mean_of_distances_and_its_spread_is_theirs():
    """Over pairs first: 0.3 and 0.5 off in the seeds, while the means are 0.1 and 0.1."""
    numbers = {("ball", 0): 0.4, ("vase", 0): -0.2, ("ball", 1): 0.6, ("vase", 1): -0.4}
    results = [result("a", seed, mesh, repetition=v, parameters=v) for (mesh, seed), v in numbers.items()]
    cells = summaries(results)[-1].cells
    cell = cells["a", "repetition"]
    assert (cell.mean, cell.spread, cell.distance) == pytest.approx((0.1, 0, 0.4))
    assert cell.distance_spread == pytest.approx(math.sqrt(0.02))
    assert math.isnan(cells["a", "parameters"].distance)


def test_a_table_tells_distances_where_values_lie_on_both_sides_of_the_best():
    results = [result("a", 0, mesh, repetition=v, gram=2.0) for mesh, v in (("ball", 0.4), ("vase", -0.2))]
    html = table_html(summaries(results)[-1], {}, "all")
    assert (
        '<td data-value="0.3">0.100<span class="spread"></span><span class="spread">distance 0.300</' in html
    )
    assert html.count("distance 0") == 1 and "best is 0, sorted by distance" in html
    assert '<td data-value="2">2.00<span class="spread"></span></td>' in html


class TestBest:
    def of(self, key, **cells):
        """By distances and their spreads."""
        return best(BY_KEY[key], {name: Cell(9.0, 9.0, 3, *cell) for name, cell in cells.items()})

    def marked(self, key, **values):
        """Of two meshes with the same values in two seeds: which methods are."""
        numbers = [(m, s, k) for m in values for s in (0, 1) for k in (0, 1)]
        results = [result(m, s, ("ball", "vase")[k], **{key: values[m][k]}) for m, s, k in numbers]
        table = summaries(results)[-1]
        return [m for m in values if table.cells[m, key].best]

    def test_the_lowest_by_more_than_both_spreads(self):
        assert self.of("gram", a=(1.0, 0.2), b=(1.5, 0.2)) == "a"
        assert self.of("gram", a=(1.0, 0.3), b=(1.5, 0.2)) is None

    def test_better_than_every_other(self):
        assert self.of("gram", a=(1.0, 0.1), b=(2.0, 0.1), c=(3.0, 2.5)) is None

    def test_nearest_to_one_and_to_zero(self):
        assert self.marked("seams", a=(0.5, 0.5), b=(1.1, 1.1)) == ["b"]
        assert self.marked("repetition", a=(-0.5, -0.5), b=(0.1, 0.1)) == ["b"]

    def test_opposite_errors_do_not_cancel(self):
        assert self.marked("repetition", a=(-0.3, 0.3), b=(0.1, 0.1)) == ["b"]
        assert self.marked("seams", a=(0.5, 1.5), b=(1.2, 1.2)) == ["b"]

    def test_nothing_is_certain_of_one_seed_or_one_method(self):
        assert self.of("gram", a=(1.0, math.nan), b=(9.0, math.nan)) is None
        assert self.of("gram", a=(1.0, 0.1)) is None

    def test_more_parameters_are_neither_good_nor_bad(self):
        assert self.of("parameters", a=(1.0, 0.0), b=(9.0, 0.0)) is None

    def test_it_is_marked_in_the_table(self):
        values = {"a": (1.0, 1.1), "b": (2.0, 2.1)}
        results = [result(name, k, gram=v) for name, pair in values.items() for k, v in enumerate(pair)]
        (table,) = summaries(results)
        assert [table.cells[name, "gram"].best for name in ("a", "b")] == [True, False]
