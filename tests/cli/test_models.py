"""`mitex models --like`."""

import json

import pytest

from mitex.cli import main
from mitex.cli.models import listing


def first(capsys, text: str) -> list[str]:
    assert main(["models", "--like", text, "--json"]) == 0
    return [model["name"] for model in json.loads(capsys.readouterr().out)]


@pytest.mark.parametrize(
    ("text", "name"),
    [("blue knit", "knit"), ("lava", "lava")],
)
def test_what_fits_comes_first(text, name, capsys):
    names = first(capsys, text)
    assert name in names[:3]
    assert sorted(names) == sorted(model["name"] for model in listing())


def test_the_text_says_how_like(capsys):
    assert main(["models", "--like", "blue knit"]) == 0
    likeness = [
        float(line.split()[1].strip(","))
        for line in capsys.readouterr().out.splitlines()
        if "likeness" in line
    ]
    assert likeness == sorted(likeness, reverse=True) and len(likeness) == len(listing())


def test_an_unknown_word_is_one_line(capsys):
    assert main(["models", "--like", "blue knot and graay stones"]) == 2
    error = capsys.readouterr().err.strip()
    assert "\n" not in error and "'graay'; did you mean gray?" in error
