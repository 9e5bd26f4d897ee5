"""The pages in a browser: the report is sorted and shows other seeds, the study saves what was chosen."""

import base64
import json
import re
from dataclasses import replace

import numpy as np
import pytest

from mitex.batch import Plan
from mitex.comparison.answers import read_answers
from mitex.comparison.measures import BY_KEY
from mitex.comparison.page import Page
from mitex.comparison.provenance import Provenance
from mitex.comparison.results import LIT, labels
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


def report(results, exemplars=("lava",)):
    """The text of a report with two columns."""
    measures = BY_KEY["seams"], BY_KEY["gram"]
    plan = Plan.of({"exemplars": ["lava"], "meshes": ["vase"], "methods": {"gatys": {}}})
    pictures, tables = dict.fromkeys(exemplars, np.zeros((4, 4, 3))), summaries(results, measures)
    return Page(results, tables, pictures, {}, (), measures, (), Provenance(plan, {})).html()


def with_seeds(folder, seeds):
    """Results of methods with these seeds, which have pictures: method -> seeds."""
    pairs = [(method, seed) for method, of_method in seeds.items() for seed in of_method]
    for k, (method, seed) in enumerate(pairs):
        picture = bad.image(folder / f"{method}-{seed}.jpg", (8, 8), "JPEG", seed=k)
        yield replace(result(method, seed), numbers={"gram": 1.0 + k}, pictures={LIT: picture})


def rows_of(html):
    """Method -> the contents of its other cells."""
    rows = re.findall(r'<tr><td data-value="(.)">.</td>(.*?)</tr>', html)
    return {name: re.findall(r"<td[^>]*>(.*?)</td>", cells) for name, cells in rows}


def test_inputs_of_one_name_are_told_apart_by_their_folders(tmp_path):
    """Also those whose folders and names are the same; names and words stay as they are."""
    files = ["/x/t.png", "/y/t.png", "/a/s/u.png", "/b/s/u.png", "/a/v.png"]
    names = ["x/t.png", "y/t.png", "/a/s/u.png", "/b/s/u.png", "v"]
    words = "black/white tiles"
    assert labels([*files, words]) == dict(zip([*files, words], [*names, words], strict=True))
    picture = bad.image(tmp_path / "a.jpg", (8, 8), "JPEG")
    results = [
        replace(result("a", 0, mesh), exemplar=exemplar, pictures={LIT: picture})
        for exemplar in files[:2]
        for mesh in ("/m/ball.obj", "/n/ball.obj")
    ]
    html = report(results, files[:2])
    for title in ("x/t.png on m/ball.obj", "y/t.png on n/ball.obj"):
        assert f"<h3>{title}</h3>" in html and f'alt="{title} by a, seed 0"' in html
    assert "x/t.png, y/t.png on m/ball.obj, n/ball.obj; 1 seed</p>" in html
    assert "<th>x/t.png</th>" in html and "<th>n/ball.obj</th>" in html


class TestUnequalSeeds:
    """A method of one seed beside one of three; one with another seed, and one with that of its preset."""

    SEEDS = {"a": (0,), "b": (0, 1, 2), "c": (5,), "d": (None,)}

    def test_each_row_says_how_many_there_are(self, tmp_path):
        html = report(list(with_seeds(tmp_path, self.SEEDS)))
        assert [(name, cells[0]) for name, cells in rows_of(html).items()] == [
            *zip("abcd", "1311", strict=True)
        ]
        assert "lava on ball; 1 to 3 seeds</p>" in html
        assert "Means over as many seeds as each row says" in html and "Beside a method of one seed" in html
        assert "Seeds: as many as each row says." in html and "made the same ones" not in html

    def test_equal_ones_are_counted_once(self, tmp_path):
        html = report(list(with_seeds(tmp_path, {"a": (0, 1), "b": (0, 1)})))
        assert "; 2 seeds</p>" in html and "Means over 2 seeds ±" in html and "Beside a method" not in html

    def test_different_single_seeds_are_single_ones(self, tmp_path):
        html = report(list(with_seeds(tmp_path, {"a": (0,), "b": (5,)})))
        assert "; 1 seed</p>" in html and "how much is due to chance is not known" in html

    def test_a_number_of_fewer_seeds_than_its_row_says_so(self, tmp_path):
        one, *others = with_seeds(tmp_path, {"a": (0, 1, 2)})
        numbers = {"gram": 1.0, "seams": 1.0}
        html = report([replace(one, numbers=numbers), *others])
        seeds, seams, gram = rows_of(html)["a"]
        assert seeds == "3" and "of 1 seed<" in seams and "of" not in gram

    def test_every_method_shows_a_picture_from_the_start(self, tmp_path):
        html = report(list(with_seeds(tmp_path, self.SEEDS)))
        shown = re.findall(r'<img [^>]*alt="lava on ball by (., seed [^"]*)" data-seed="[^"]*">', html)
        assert shown == ["a, seed 0", "b, seed 0", "c, seed 5", "d, seed of the preset"]
        assert re.findall('<td data-note="(.*?)"', html) == ["", "", "seed 5", "seed of the preset"]
        assert re.findall("<button value=.*?>(.*?)</button>", html) == ["0", "1", "2", "5"]

    def test_a_button_leaves_the_pictures_of_methods_without_its_seed(self, browser, tmp_path):
        (tmp_path / "report.html").write_text(report(list(with_seeds(tmp_path, self.SEEDS))))
        tab = browser.open(tmp_path / "report.html")
        notes = {"1": ["seed 0", "", "seed 5"], "5": ["seed 0", "seed 0", ""], "0": ["", "", "seed 5"]}
        for seed, expected in notes.items():
            tab.page.locator(f".seeds button[value='{seed}']").click()
            assert tab.page.locator(VISIBLE).count() == 4
            cells = tab.page.locator(".looks td[data-note]").all()
            assert [cell.get_attribute("data-note") for cell in cells] == [*expected, "seed of the preset"]
        assert not tab.errors


class TestReport:
    @pytest.fixture
    def page(self, browser, tmp_path):
        (tmp_path / "report.html").write_text(report(list(made(tmp_path, "abcd"))))
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
