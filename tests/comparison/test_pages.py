"""The pages in a browser: the report is sorted and shows other seeds, the study saves what was chosen."""

import base64
import json
from dataclasses import replace

import numpy as np
import pytest

from mitex.batch import Plan
from mitex.comparison.answers import read_answers
from mitex.comparison.measures import BY_KEY
from mitex.comparison.page import Page
from mitex.comparison.provenance import Provenance
from mitex.comparison.results import LIT
from mitex.comparison.study import Study, write_study
from mitex.comparison.summary import summaries
from tests.cli import bad_files as bad
from tests.comparison.test_summary import result

SEAMS = {"a": (0.5, 0.7), "b": (1.2, 1.2), "c": (0.9, 0.9)}  # of two seeds; d has none
GRAMS = {"a": (100.0, 100.0), "b": (5.0, 6.0), "c": (10.0, 8.0)}
NUMBERS = {"seams": SEAMS, "gram": GRAMS}
VISIBLE = ".looks img[data-seed]:visible"


def made(folder, methods, seeds=2):
    """Results with pictures, of which no two are alike."""
    for k, method in enumerate(methods):
        for seed in range(seeds):
            one = result(method, seed)
            picture = bad.image(folder / f"{one.id}.jpg", (8, 8), "JPEG", seed=10 * k + seed)
            numbers = {key: values[method][seed] for key, values in NUMBERS.items() if method in values}
            yield replace(one, numbers=numbers, pictures={LIT: picture})


def test_a_report_of_nothing_says_so():
    plan = Plan.of({"exemplars": ["lava"], "meshes": ["vase"], "methods": {"gatys": {}}})
    html = Page((), (), {}, {}, ("gatys: it failed",), (), (), Provenance(plan, {})).html()
    assert "<h1>Measuring nothing</h1>" in html and '<p class="soft">0 seeds</p>' in html
    assert "<li>gatys: it failed</li>" in html


class TestReport:
    @pytest.fixture
    def page(self, browser, tmp_path):
        measures, results = (BY_KEY["seams"], BY_KEY["gram"]), list(made(tmp_path, "abcd"))
        plan = Plan.of({"exemplars": ["lava"], "meshes": ["vase"], "methods": {"gatys": {}}})
        tables = summaries(results, measures)
        exemplars = {"lava": np.zeros((4, 4, 3))}
        page = Page(results, tables, exemplars, {}, (), measures, (), Provenance(plan, {}))
        (tmp_path / "report.html").write_text(page.html())
        tab = browser.open(tmp_path / "report.html")
        yield tab.page
        assert not tab.errors

    def order(self, page):
        return page.locator(".numbers tbody td:first-child").all_inner_texts()

    def test_headings_sort_the_table(self, page):
        """By how far a number is from the best one; what is unknown stands last in either direction."""
        assert self.order(page) == ["a", "b", "c", "d"]
        for heading, expected in (("Seam ratio", "cba"), ("Gram", "bca")):
            button = page.locator(".numbers thead button", has_text=heading)
            button.click()
            assert self.order(page) == [*expected, "d"]
            button.click()
            assert self.order(page) == [*reversed(expected), "d"]
            sorted_by = page.locator("[aria-sort]").all_inner_texts()
            assert len(sorted_by) == 1 and heading in sorted_by[0]
        page.locator(".numbers thead button", has_text="method").click()
        assert self.order(page) == ["a", "b", "c", "d"]

    def test_buttons_show_the_other_seed(self, page):
        def shown():
            return {image.get_attribute("data-seed") for image in page.locator(VISIBLE).all()}

        assert shown() == {"0"}
        for seed in "10":
            page.locator(f".seeds button[value='{seed}']").click()
            assert shown() == {seed} and page.locator(VISIBLE).count() == 4
            assert page.locator("[aria-pressed=true]").all_inner_texts() == [seed]


class TestStudy:
    @pytest.fixture
    def ask(self, browser, tmp_path):
        """Opens the study of three methods, whose questions stay in order, with all sides swapped or none."""
        asked, tabs = [], []

        def ask(exemplar, swapped):
            asked.append(exemplar)
            image = None if exemplar == "red bricks" else np.full((4, 4, 3), 0.5)
            results = [replace(one, exemplar=exemplar) for one in made(tmp_path, "abc", 1)]
            page = write_study(tmp_path, results, {exemplar: image})
            tabs.append(browser.open(page, before=f"Math.random = () => {0.1 if swapped else 0.9}"))
            tabs[-1].page.click("#begin")
            return tabs[-1].page

        yield ask
        assert asked and not any(tab.errors for tab in tabs)  # without a browser, opening skips the test

    def method(self, page, side, folder):
        """Whose picture is on a side."""
        shown = base64.b64decode(page.locator(f"#{side} img").get_attribute("src").partition(",")[2])
        return next(m for m in "abc" if (folder / f"{m}-0-ball.jpg").read_bytes() == shown)

    @pytest.mark.parametrize("swapped", [False, True])
    def test_what_was_chosen_is_what_is_read(self, swapped, ask, tmp_path):
        page, study = ask("lava", swapped), Study.load(tmp_path)
        assert page.locator(".reference img").get_attribute("src").startswith("data:image/jpeg")
        chosen = []
        for question, side in zip(study.questions, ("left", "right", None), strict=True):
            sides = [self.method(page, name, tmp_path) for name in ("left", "right")]
            assert sides == list(reversed(question.methods) if swapped else question.methods)
            chosen.append(None if side is None else sides[("left", "right").index(side)])
            if side == "right":
                page.keyboard.press("ArrowRight")
            else:
                page.click(f"#{side or 'neither'}")
        with page.expect_download() as download:
            page.click("#save")
        file = tmp_path / "answers.json"
        download.value.save_as(file)
        ((_, answers),) = read_answers(study, [file]).items()
        methods = [study.questions[one.question].methods for one in answers]
        picked = [
            None if one.choice is None else pair[one.choice]
            for one, pair in zip(answers, methods, strict=True)
        ]
        assert picked == chosen and [one.question for one in answers] == [0, 1, 2]
        assert {entry["swapped"] for entry in json.loads(file.read_text())["answers"]} == {swapped}

    def test_a_key_that_is_held_down_answers_once(self, ask):
        page = ask("lava", False)
        for _ in range(3):  # from the second on, the browser says that it repeats
            page.keyboard.down("ArrowRight")
        assert page.locator("#count").inner_text() == "2 of 3"

    def test_answers_are_not_lost_unasked(self, ask):
        """The page asks before it is left, from the first answer on, until they are saved."""
        page = ask("lava", False)
        leaves = """() => {
            const event = new Event("beforeunload", { cancelable: true });
            return window.dispatchEvent(event);
        }"""
        assert page.evaluate(leaves)
        for _ in range(3):
            page.keyboard.press("ArrowRight")
            assert not page.evaluate(leaves)
        with page.expect_download():
            page.click("#save")
        assert page.evaluate(leaves)

    def test_words_stand_in_the_place_of_the_texture(self, ask):
        page = ask("red bricks", False)
        assert page.locator(".reference").inner_text() == "red bricks"
        assert page.locator(".reference img").count() == 0
