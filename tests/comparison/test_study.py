"""A blind test: what the page tells, and what is made of the answers."""

import base64
import json
import re
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import scipy.stats

from mitex.cli import main
from mitex.comparison import compare
from mitex.comparison.answers import Answer, blocked_anova, evaluate, holm, read_answers, wilson_interval
from mitex.comparison.results import LIT, VIEW
from mitex.comparison.study import KEY, PAGE, Question, Study, write_study
from mitex.errors import ConfigError
from tests.cli import bad_files as bad
from tests.comparison.conftest import words_plan
from tests.comparison.test_summary import result

DOCS = Path(__file__).parents[2] / "docs"
WORDS = ("red bricks", "-green/blue marble")
EXEMPLARS = {"lava": np.zeros((4, 4, 3))}


@pytest.fixture
def study(tmp_path):
    """Of three methods on two meshes, but one of them on one alone; two seeds."""
    results = []
    for k, (method, mesh) in enumerate(
        [("a", "ball"), ("b", "ball"), ("c", "ball"), ("a", "vase"), ("b", "vase")]
    ):
        for seed in (0, 1):
            one = result(method, seed, mesh)
            picture = bad.image(tmp_path / f"{one.id}.jpg", (8, 8), "JPEG", seed=10 * k + seed)
            results.append(replace(one, pictures={LIT: picture}))
    views = [replace(result(name, 0, None), pictures={VIEW: tmp_path / "none.jpg"}) for name in "de"]
    write_study(tmp_path, [*results, *views], EXEMPLARS)
    return Study.load(tmp_path)


def test_all_pairs_of_what_was_made_are_asked_about(study):
    """On meshes, and not where something was captured."""
    asked = sorted((question.mesh, question.methods) for question in study.questions)
    assert asked == [("ball", ("a", "b")), ("ball", ("a", "c")), ("ball", ("b", "c")), ("vase", ("a", "b"))]


def page_data(page):
    """What the script of a study's page reads."""
    return json.loads(re.findall(r'<script id="data" type="application/json">(.*?)</script>', page)[0])


def test_the_page_shows_the_pictures_and_names_nothing(study, tmp_path):
    page = (tmp_path / PAGE).read_text()
    data = page_data(page)
    assert data["id"] == study.id and len(data["pictures"]) == 6  # the first seed's, and the exemplar
    for asked, question in zip(data["questions"], study.questions, strict=True):
        for choice, method in zip(asked["choices"], question.methods, strict=True):
            shown = base64.b64decode(data["pictures"][choice])
            assert shown == (tmp_path / f"{method}-0-{question.mesh}.jpg").read_bytes()
    assert "http" not in page and "lava" not in page and "vase" not in page


def test_other_names_of_the_same_pictures_are_another_study(tmp_path):
    """Their questions come in another order."""
    picture = bad.image(tmp_path / "a.jpg", (8, 8), "JPEG")
    ids = set()
    for names in ("ab", "ac"):
        results = [replace(result(name, 0, "ball"), pictures={LIT: picture}) for name in names]
        write_study(tmp_path, results, EXEMPLARS)
        ids.add(Study.load(tmp_path).id)
    assert len(ids) == 2


def test_one_method_is_nothing_to_ask_about(tmp_path):
    with pytest.raises(ConfigError, match="no two methods"):
        write_study(tmp_path, [result("a", 0)], EXEMPLARS)
    assert not (tmp_path / KEY).exists()


def test_words_are_shown_themselves(tmp_path):
    """Whatever stands in them."""
    words = "</script>$style red bricks"
    picture = bad.image(tmp_path / "a.jpg", (8, 8), "JPEG")
    made = [replace(result(m, 0), exemplar=words, pictures={LIT: picture}) for m in "ab"]
    data = page_data(write_study(tmp_path, made, {words: None}).read_text())
    assert [asked["exemplar"] for asked in data["questions"]] == [words] and len(data["pictures"]) == 1
    assert Study.load(tmp_path).questions == (Question(words, "ball", ("a", "b")),)


@pytest.mark.usefixtures("small", "grey")
class TestComparisons:
    """The whole way, with jobs that take no time."""

    def test_words_can_be_asked_about(self, place):
        done = compare(words_plan(WORDS), "out", study=True)
        assert done.missing == 0 and {"mes", "mes_dir"} <= done.results[0].numbers.keys()
        asked = {(question.exemplar, question.methods) for question in Study.load("out").questions}
        assert asked == {(words, ("nca", "x_mesh")) for words in WORDS}

    def test_one_method_is_refused_before_any_work(self, place):
        with pytest.raises(ConfigError, match="a study of one method"):
            compare(words_plan(WORDS, ["nca"]), "out", study=True)
        assert not (place / "out").exists()

    def test_if_the_others_fail_the_report_is_there(self, place, monkeypatch):
        monkeypatch.setattr("tests.comparison.conftest.Grey.failing", ("x_mesh",))
        with pytest.raises(ConfigError, match="no two methods"):
            compare(words_plan(WORDS), "out", study=True)
        assert {"report.html", "report.csv", "report.json"} <= {file.name for file in place.glob("out/*")}


CASES = Study("x", tuple(Question("lava", mesh, ("a", "b")) for mesh in ("ball", "vase", "knot")))


def many_cases(count, methods=("a", "b")):
    return Study("x", tuple(Question("lava", str(k), methods) for k in range(count)))


def answers(*choices):
    return [Answer(k, choice) for k, choice in enumerate(choices)]


class TestEvaluation:
    def test_shares_and_their_interval(self):
        done = evaluate(CASES, {"x": answers(0, 0, 1), "y": answers(0, None, 0)})
        first, second = done.preferences
        assert (first.method, first.wins, first.count) == ("a", 4.5, 6)
        assert second.share == 0.25
        low, high = first.interval
        z = scipy.stats.norm.ppf(0.975)  # Wilson's interval solves |p - 4.5 / 6| = z sqrt(p (1 - p) / 6)
        for p in (low, high):
            assert abs(p - 4.5 / 6) == pytest.approx(z * np.sqrt(p * (1 - p) / 6), rel=1e-6)

    @pytest.mark.parametrize(("wins", "count"), [(0, 5), (3, 7), (5, 5), (40, 41)])
    def test_the_interval_is_scipys_where_nothing_is_halved(self, wins, count):
        expected = scipy.stats.binomtest(wins, count).proportion_ci(method="wilson")
        assert wilson_interval(wins / count, count) == pytest.approx((expected.low, expected.high), abs=1e-12)

    def test_the_spread_is_over_cases_and_the_published_test_takes_them_as_blocks(self):
        """a was preferred by all on the ball, by half on the vase and the knot."""
        done = evaluate(CASES, {"x": answers(0, 0, 1), "y": answers(0, 1, 0)})
        a, b = [1.0, 0.5, 0.5], [0.0, 0.5, 0.5]
        assert done.preferences[0].mean == pytest.approx(2 / 3)
        assert done.preferences[0].spread == pytest.approx(np.std(a, ddof=1))
        t: Any = scipy.stats.ttest_rel(a, b)  # of two methods both tests are one
        assert (done.f, done.published_p) == pytest.approx((t.statistic**2, t.pvalue))

    def test_the_analysis_of_variance_is_that_of_sums_of_squares(self):
        """What cases and methods do not explain is the error; cases that lack a method do not count."""
        shares = np.random.default_rng(0).random((5, 3))
        of_all, of_cases, of_methods = shares.mean(), shares.mean(1), shares.mean(0)
        total = sum((value - of_all) ** 2 for value in shares.flat)
        cases = sum(3 * (value - of_all) ** 2 for value in of_cases)
        between = sum(5 * (value - of_all) ** 2 for value in of_methods)
        f = (between / 2) / ((total - cases - between) / 8)
        expected = f, scipy.stats.f(2, 8).sf(f)
        assert blocked_anova(shares) == pytest.approx(expected)
        assert blocked_anova(np.vstack([shares, [0.9, np.nan, 0.1]])) == pytest.approx(expected)

    @pytest.mark.parametrize(
        ("f", "p"), [(8.44196, 0.001028), (6.2159, 0.004376), (15.08026, 0.000037), (13.77907, 0.000065)]
    )
    def test_p_is_the_papers(self, f, p):
        """Of four methods in seven cases (Kovacs et al. 2024): shares whose F is theirs."""
        residuals = np.random.default_rng(0).normal(size=(7, 4))
        residuals -= residuals.mean(0)
        residuals -= residuals.mean(1, keepdims=True)
        effects = np.array([3.0, -1.0, -1.0, -1.0])
        unscaled, _ = blocked_anova(residuals + effects)
        done = blocked_anova(residuals + effects * np.sqrt(f / unscaled))
        assert done[0] == pytest.approx(f) and done[1] == pytest.approx(p, abs=6e-7)

    def test_one_method_that_wins_every_case_has_p_of_all_signs_alike(self):
        """Of n cases 2 of 2 ** n relabellings differ as much; cases without a difference say nothing."""
        study = many_cases(6)
        done = evaluate(study, {"x": answers(*[0] * 6)})
        assert done.p == done.pairs["a", "b"] == 2 / 2**6
        assert np.isnan([done.f, done.published_p]).all()  # all cases are alike
        done = evaluate(study, {"x": answers(*[0] * 5, None)})
        assert done.p == 2 / 2**5

    def test_pairs_are_tested_in_the_cases_that_both_are_in(self):
        """a and b have two cases, which can tell nothing; of the whole the sums of all three count."""
        questions = [Question("lava", str(k), ("a", other)) for k, other in enumerate("bbccc")]
        done = evaluate(Study("x", tuple(questions)), {"x": answers(*[0] * 5)})
        raw = {("a", "b"): 2 / 4, ("a", "c"): 2 / 8, ("b", "c"): 1.0}
        assert done.pairs == pytest.approx(holm(raw))
        assert done.p == 2 / 2**5
        assert "permutation test over cases: p = 0.062\na and c: p = 0.75\na and b: p = 1\n" in done.text()

    def test_the_guides_example_is_of_such_answers(self):
        """Twelve people in twelve cases, of whom this many preferred the first."""
        study = many_cases(12, ("surface", "image_quilting"))
        wins = (12, 12, 12, 11, 11, 10, 10, 10, 9, 8, 6, 5)
        people = {str(k): answers(*(int(k >= count) for count in wins)) for k in range(12)}
        assert f"```text\n{evaluate(study, people).text()}\n```" in (DOCS / "compare.md").read_text("utf-8")

    def test_p_is_adjusted_by_holms_procedure(self):
        raw = {("a", "b"): 0.01, ("a", "c"): 0.04, ("b", "c"): 0.03}
        assert holm(raw) == {("a", "b"): 0.03, ("b", "c"): 0.06, ("a", "c"): 0.06}

    def test_one_case_has_no_spread(self):
        done = evaluate(CASES, {"x": answers(0), "y": answers(1)})
        assert np.isnan([done.f, done.published_p, done.p]).all() and done.pairs == {}
        assert "needs two methods in two cases" in done.text() and "±" not in done.text()

    def test_a_method_of_one_case_is_left_out_and_named(self):
        """The tests are those without it; its share is told."""
        also = Study("x", (*CASES.questions, Question("lava", "cow", ("a", "c"))))
        without = Study("x", (*CASES.questions, Question("lava", "cow", ("a", "b"))))
        (done, other) = (
            evaluate(s, {"x": answers(0, 0, 1, 1), "y": answers(0, 1, 0, 0)}) for s in (also, without)
        )
        assert done.untested == ("c",) and done.pairs.keys() == {("a", "b")}
        a, b = [1.0, 0.5, 0.5, 0.5], [0.0, 0.5, 0.5]
        t: Any = scipy.stats.ttest_rel(a[:3], b)
        assert (done.f, done.published_p) == pytest.approx((t.statistic**2, t.pvalue))
        assert done.p == 1  # one case of three differs, either way as much
        text = "of a single case, and not tested: c\n"
        assert text in done.text() and other.untested == () and text not in other.text()
        assert {one.method: one.count for one in done.preferences}["c"] == 2


def saved(path, study="x", participant="p", entries=((0, 0), (1, 1), (2, 0))):
    record = {
        "study": study,
        "participant": participant,
        "answers": [{"question": q, "choice": c, "seconds": 1.5} for q, c in entries],
    }
    path.write_text(json.dumps(record))
    return path


def test_files_to_answers(tmp_path):
    files = [saved(tmp_path / "1.json"), saved(tmp_path / "2.json", participant="q", entries=((2, None),))]
    people = read_answers(CASES, files)
    assert people == {"p": answers(0, 1, 0), "q": [Answer(2, None)]}


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"study": "y"}, "answers another study"),
        ({"entries": ((3, 0),)}, "holds no answers"),
        ({"entries": ((-1, 0),)}, "holds no answers"),
        ({"entries": ((0, 2),)}, "holds no answers"),
        ({"entries": ((1, 0), (0, 1), (1, 0))}, "answers a question twice"),
        ({"entries": ()}, "there are no answers"),
    ],
)
def test_answers_that_do_not_fit(tmp_path, change, message):
    with pytest.raises(ConfigError, match=message):
        read_answers(CASES, [saved(tmp_path / "1.json", **change)])


def test_files_that_are_none(tmp_path):
    (tmp_path / "bad.json").write_text("[" * 100_000)
    for name in ("bad.json", "missing.json", "."):
        with pytest.raises(ConfigError, match="answers"):
            read_answers(CASES, [tmp_path / name])


@pytest.mark.parametrize(
    "text",
    [
        "[" * 100_000,
        json.dumps({"id": "x", "questions": [{"exemplar": "lava", "mesh": ["ball"], "methods": ["a", "b"]}]}),
        json.dumps({"id": "x", "questions": [{"exemplar": "lava", "mesh": "ball", "methods": ["a"]}]}),
        json.dumps({"id": "x", "questions": [{"exemplar": "lava", "mesh": "ball", "methods": ["a", "a"]}]}),
        json.dumps({"id": "x", "questions": [["lava", "ball", ["a", "b"]]]}),
        json.dumps({"id": 3, "questions": []}),
    ],
)
def test_studies_that_are_none(tmp_path, text):
    (tmp_path / KEY).write_text(text)
    with pytest.raises(ConfigError, match="holds no study"):
        Study.load(tmp_path)


def test_a_persons_answers_count_once_whatever_their_file_is_called(tmp_path):
    """Also those that a person saved twice, the second time with more."""
    first = saved(tmp_path / "1.json", entries=((0, 0),))
    for again in (first, saved(tmp_path / "renamed.json")):
        with pytest.raises(ConfigError, match=f"the answers in '{again}' are there twice"):
            read_answers(CASES, [first, again])


def test_the_command(study, tmp_path, capsys):
    file = saved(tmp_path / "1.json", study.id)
    assert main(["compare", "answers", str(tmp_path), str(file)]) == 0
    assert capsys.readouterr().out.startswith("answers of 1 person\n")
    assert main(["compare", "answers", str(tmp_path / "no"), str(file)]) == 2
    assert "holds no study" in capsys.readouterr().err
