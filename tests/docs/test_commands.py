"""Every command and every snippet of README and the guides, as they stand.

The blocks of a page are run in their order in one folder, Python in one namespace, as a reader would. `mitex`
is run by its own command line; `make`, `pip` and `python` are looked up: the target, the extra, the script.
`small.py` says what is made small meanwhile. A comment before a block marks one that cannot be run:

    <!-- not run: why -->       commands are parsed by the real command line, Python is compiled
    <!-- part of: file -->      each line stands in that file of the repository
"""

import ast
import json
import re
import tomllib

import pytest

from mitex.cli import commands, main
from mitex.cli.usage import parse
from mitex.methods.registry import methods
from tests.docs import small
from tests.docs.blocks import PAGES, PROGRAMS, ROOT, Block, blocks

LANGUAGES = {"python", "sh", "toml", "json", "text", ""}
EXTRAS = set(tomllib.loads((ROOT / "pyproject.toml").read_text())["project"]["optional-dependencies"])
RUN = [page for page in PAGES if any(block.language in ("python", "sh") for block in blocks(page))]


@pytest.fixture(scope="module")
def toy():
    """The method that a page describes is installed."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(ROOT / "tests" / "toy")
        methods.cache_clear()
        yield
    methods.cache_clear()


@pytest.fixture
def place(tmp_path, monkeypatch, own_cache, quick_settling, toy):
    """A folder with the files that the pages name; work in it is small."""
    small.prepare(tmp_path)
    small.shrink(monkeypatch)
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.mark.parametrize("page", RUN, ids=lambda page: str(page.relative_to(ROOT)))
def test_a_page_runs_as_it_stands(page, place, capsys):
    names = {"__name__": "__main__"}
    for block in blocks(page):
        if block.mark:
            check_marked(block)
        elif block.language == "python":
            exec(compile(block.text, block.place, "exec"), names)
        elif block.language == "sh":
            for words in block.commands():
                run(words, block.place, capsys)


def run(words, place, capsys):
    """Runs a command of Mitex, and looks up what another one names."""
    program, *rest = words
    match program.rpartition("/")[2]:
        case "mitex":
            code = main(rest)
            assert code == 0, f"{place}: {' '.join(words)}\n{capsys.readouterr().err}"
        case "make":
            targets = re.findall(r"^(\w+):", (ROOT / "Makefile").read_text(), re.MULTILINE)
            assert {word for word in rest if "=" not in word} <= set(targets), place
        case "pip":
            named = re.findall(r"mitex\[([\w,]+)\]", " ".join(rest))
            assert {extra for names in named for extra in names.split(",")} <= EXTRAS, place
        case "python":
            assert rest[0] == "-m" or (ROOT / rest[0]).is_file(), place
        case _:
            pytest.fail(f"{place}: {program} is none of {', '.join(PROGRAMS)}")


def check_marked(block: Block):
    """As far as a block is checked that is not run."""
    kind, text = block.mark or ("", "")
    if kind == "part of":
        file = {line.strip() for line in (ROOT / text).read_text().splitlines()}
        lines = {line.strip() for line in block.text.splitlines() if "..." not in line}
        assert lines - file - {""} == set(), f"{block.place}: not in {text}"
    elif block.language == "python":
        ast.parse(block.text, block.place)
    elif block.language == "sh":
        for program, *words in block.commands():
            if program == "mitex":
                call = commands.find(words)
                parse(call.command, call.words, call.program)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: str(page.relative_to(ROOT)))
def test_blocks_are_of_languages_that_are_checked(page):
    for block in blocks(page):
        assert block.language in LANGUAGES, block.place
        if block.language == "toml":
            tomllib.loads(block.text)
        if block.language == "json":
            json.loads(block.text)
        if block.language in ("", "text"):
            assert not re.search(r"^\s*(mitex|python|make) [\w-]", block.text, re.MULTILINE), block.place
