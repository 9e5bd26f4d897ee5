"""The guides: one outline for all methods, short, with pictures that exist, described and attributed."""

import re
from pathlib import Path

import pytest

from mitex.methods.registry import PACKAGES, methods

DOCS = Path(__file__).parents[2] / "docs"
OUTLINE = [
    "What it is for",
    "Three commands",
    "What comes out",
    "The five settings that matter",
    "When to use another method",
    "Limits",
]
MOST_WORDS = 900
METHODS = [
    name
    for name, method in methods().items()
    if method.presets.startswith(PACKAGES[0]) and not method.baseline
]
FURTHER = ["capture", "moving", "flow", "living-page"]
PICTURE = re.compile(r"!\[(.*?)\]\((.*?)\)")
FILM = re.compile(r"\]\((\S+\.mp4)\)")
NAMED_TEXTURE = re.compile(r"\b[A-Z][\w-]*_\d{3}\b")  # as 3dtextures.me names them
PAGES = [DOCS.parent / "README.md", *sorted(DOCS.rglob("*.md"))]


def read(page: Path) -> str:
    return page.read_text(encoding="utf-8")


@pytest.mark.parametrize("name", METHODS)
class TestGuide:
    def test_its_outline_is_that_of_all(self, name):
        assert re.findall(r"^## (.*)$", read(DOCS / f"{name}.md"), re.MULTILINE) == OUTLINE

    def test_it_is_short(self, name):
        text = re.sub(r"<!--.*?-->", "", read(DOCS / f"{name}.md"))
        assert len(text.split()) <= MOST_WORDS

    def test_it_begins_with_a_picture_and_names_five_settings(self, name):
        _, purpose, *_, settings, _, _ = re.split(r"^## ", read(DOCS / f"{name}.md"), flags=re.MULTILINE)
        assert PICTURE.search(purpose)
        head, _, *rows = [line for line in settings.splitlines() if line.startswith("| ")]
        assert head.startswith("| setting |") and len(rows) == 5

    def test_there_are_pages_of_its_results_and_of_its_inside(self, name):
        assert (DOCS / "results" / f"{name}.md").is_file()
        assert (DOCS / "developers" / f"{name}.md").is_file()


@pytest.mark.parametrize("name", FURTHER)
def test_guides_to_what_methods_can_do_are_short_and_begin_with_a_picture(name):
    text = read(DOCS / f"{name}.md")
    assert len(re.sub(r"<!--.*?-->", "", text).split()) <= MOST_WORDS
    first, *_, last = re.findall(r"^## (.*)$", text, re.MULTILINE)
    assert (first, last) == ("What it is for", "Limits")
    assert PICTURE.search(re.split(r"^## ", text, flags=re.MULTILINE)[1])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(DOCS.parent)))
def test_pictures_exist_and_are_described(page):
    for description, target in PICTURE.findall(read(page)):
        assert description.strip(), target
        assert (page.parent / target).is_file(), target


def test_every_sheet_of_the_gallery_is_shown():
    """A film is linked, since not every reader of Markdown shows it."""
    texts = {page: read(page) for page in PAGES}
    shown = {(page.parent / target).resolve() for page in PAGES for _, target in PICTURE.findall(texts[page])}
    shown |= {(page.parent / target).resolve() for page in PAGES for target in FILM.findall(texts[page])}
    assert {sheet.resolve() for sheet in (DOCS / "gallery").iterdir()} <= shown


def test_every_texture_of_others_that_a_page_names_is_attributed():
    named = {name for page in PAGES for name in NAMED_TEXTURE.findall(read(page))}
    assert named and named <= set(NAMED_TEXTURE.findall(read(DOCS / "attributions.md")))


def test_the_reference_has_every_method():
    headings = re.findall(
        r"^## mitex\.methods\.(\S+)$", read(DOCS / "reference" / "methods.md"), re.MULTILINE
    )
    assert set(methods()) <= {name.rpartition(".")[2] for name in headings}


def test_contributing_says_what_every_part_of_the_package_is():
    package, table = DOCS.parent / "mitex", read(DOCS.parent / "CONTRIBUTING.md")
    parts = {f"{path.parent.name}/" for path in package.glob("*/__init__.py")}
    parts |= {path.name for path in package.glob("*.py") if not path.name.startswith("__")}
    assert {part for part in parts if f"`{part}`" not in table} == set()
