"""What turns the pages into a site. `make docs` builds the site itself."""

import json
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


def test_each_page_is_in_one_group_and_unknown_ones_too(site_module):
    pages = {"README", "docs/nca", "docs/blender", "docs/new", "docs/results/nca", "docs/tutorials/b"}
    groups = site_module("navigation").groups(pages | {"CHANGELOG"}, "README")
    assert groups == {
        "Tutorials": ["docs/tutorials/b"],
        "Methods": ["docs/nca"],
        "Guides": ["docs/blender", "docs/new"],
        "Results": ["docs/results/nca"],
        "Developers": ["CHANGELOG"],
    }


def test_the_first_page_of_a_group_is_the_one_named_first(site_module):
    pages = {"docs/surface", "docs/nca", "docs/reference/export", "docs/reference/mitex"}
    groups = site_module("navigation").groups(pages, "README")
    assert groups["Methods"] == ["docs/nca", "docs/surface"]
    assert groups["Reference"] == ["docs/reference/mitex", "docs/reference/export"]


@pytest.mark.parametrize(
    ("html", "fault"),
    [
        ('<a href="b.html">', "a.html: b.html leads nowhere"),
        ('<a href="#here">', "a.html: #here leads nowhere"),
        ('<a href="index.html#there">', "a.html: index.html#there leads nowhere"),
        ('<img src="gone.png">', "a.html: gone.png leads nowhere"),
        ('<script src="https://cdn.example/x.js"></script>', "a.html: fetches https://cdn.example/x.js"),
        ('<link href="//fonts.example/x.css">', "a.html: fetches //fonts.example/x.css"),
    ],
)
def test_the_faults_of_a_site_are_named(site_module, tmp_path, html, fault):
    (tmp_path / "index.html").write_text('<h1 id="top">A page</h1>')
    (tmp_path / "a.html").write_text(html)
    check = site_module("check")
    assert check.faults(tmp_path) == [fault] and check.main(str(tmp_path)) == 1


def test_a_style_that_fetches_is_a_fault(site_module, tmp_path):
    (tmp_path / "a.css").write_text("@import url('https://fonts.example/x.css');")
    assert site_module("check").faults(tmp_path) == ["a.css: a style fetches from the network"]


def test_a_good_site_has_no_faults_and_no_site_has_one(site_module, tmp_path):
    check = site_module("check")
    assert check.main(str(tmp_path)) == 1
    (tmp_path / "own.css").write_text("a { background: url(own.png) }")
    (tmp_path / "index.html").write_text(
        '<link href="own.css"><h1 id="a%b">A</h1><a href="#a%25b">A</a><a href="index.html?q=1">again</a>'
        '<a href="https://example.org">elsewhere</a><a href="mailto:us">write</a>'
    )
    assert check.faults(tmp_path) == [] and check.main(str(tmp_path)) == 0


@pytest.mark.parametrize("path", sorted((ROOT / "docs" / "tutorials").glob("*.ipynb")), ids=lambda p: p.stem)
def test_notebooks_are_kept_without_results(path):
    cells = [cell for cell in json.loads(path.read_text())["cells"] if cell["cell_type"] == "code"]
    assert cells and all(cell["outputs"] == [] and cell["execution_count"] is None for cell in cells)
