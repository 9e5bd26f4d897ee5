"""The page of settings is the one that the script writes, and leaves nothing out."""

from dataclasses import fields
from importlib import import_module
from pathlib import Path

import pytest

from mitex.methods.registry import methods
from mitex.training.settings import rows

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def script():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "tools"))
        yield import_module("make_settings_page")


def test_the_page_is_up_to_date(script):
    written = (ROOT / "docs" / "reference" / "settings.md").read_text(encoding="utf-8")
    assert written == script.page(), "run `python tools/make_settings_page.py`"


@pytest.mark.parametrize("name", ["nca", "surface", "geometric", "nerf", "quilted"])
def test_every_setting_has_a_row_with_the_values_of_all_presets(script, name):
    method = methods()[name]
    head, _, *lines = [line for line in script.section(method) if line.startswith("|")]
    presets = method.load_presets()
    assert head.split(" | ")[1:-2] == [f"`{preset}`" for preset in presets]
    default = next(iter(presets.values()))
    keys = [one.name for one in fields(default) if one.name != "preset"]
    assert [line.split(" | ")[0] for line in lines] == [f"| `{key}`" for key in keys]


def test_another_preset_shows_only_what_differs(script):
    lines = list(script.section(methods()["surface"]))
    (steps,) = [line for line in lines if line.startswith("| `steps`")]
    (frames,) = [line for line in lines if line.startswith("| `frames`")]
    assert steps.split(" | ")[1:5] == ["`60`", "`200`", "`500`", "`300`"]
    assert frames.split(" | ")[1:5] == ["`smooth`", "", "`fixed`", ""]


def test_a_bar_does_not_end_a_cell(script):
    assert script.line(["a|b", "c"]) == r"| a\|b | c |"


def test_meanings_stand_alone():
    """They are read in a table and under `--settings`, far from the name of what they are of."""
    for method in methods().values():
        for row in rows(next(iter(method.load_presets().values()))):
            assert not row.meaning.startswith(("of ", "that ", "its ", "as ")), f"{method.name}: {row.name}"
