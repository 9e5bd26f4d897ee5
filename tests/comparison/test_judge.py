"""Which model judges textures from words: it is a choice, and told with the numbers."""

import json

import pytest

from mitex.cli import main
from mitex.comparison import compare
from mitex.errors import ConfigError, WeightsError
from tests.comparison.conftest import words_plan
from tests.comparison.test_run import quilting
from tests.features.clip.folders import write_folder


@pytest.mark.usefixtures("small", "grey")
def test_the_judge_is_told_and_another_one_measures_again(place):
    plan, clip = words_plan(["red dots"], ["nca"]), str(write_folder(place / "clip-x"))

    def scores(judge):
        (result,) = compare(plan, "out", judge=judge).results
        return result.numbers["mes"], json.loads((place / "out" / "report.json").read_text())["judge"]

    ours, name = scores("words")
    assert name == "the embedded vision-language model"
    assert name in (place / "out" / "report.html").read_text()
    theirs, name = scores(clip)
    assert theirs != pytest.approx(ours, abs=0.01) and name == "clip-x"
    assert "The judge: clip-x." in (place / "out" / "report.html").read_text()
    assert scores("words") == (pytest.approx(ours, abs=0.001), "the embedded vision-language model")


def test_a_judge_that_is_not_there_is_refused_before_any_work(place):
    with pytest.raises(WeightsError, match="is no CLIP model"):
        compare(words_plan(["red dots"]), "out", judge="nowhere")
    with pytest.raises(ConfigError, match="no words to judge"):
        compare(quilting(), "out", judge="words")
    assert not (place / "out").exists()


def test_at_the_command_line(place, capsys):
    plan = 'exemplars = ["red"]\nmeshes = ["ball.obj"]\n[methods.nca]\nsource = "text"\n'
    (place / "plan.toml").write_text(plan)
    assert main(["compare", "--plan", "plan.toml", "--judge", "nowhere", "--out", "out", "--quiet"]) == 2
    assert "error: 'nowhere' is no CLIP model" in capsys.readouterr().err
