"""What is measured where methods learn relief or words."""

import numpy as np
import pytest

from mitex.asset import Asset, clay
from mitex.batch import Plan
from mitex.batch.jobs import jobs_of
from mitex.comparison import text_pair
from mitex.comparison.measures import BY_KEY, RELIEFS, TEXTS
from mitex.comparison.plan import prepared, source_of
from mitex.comparison.relief_pair import ReliefPair
from mitex.comparison.text_pair import TextPair
from mitex.errors import ConfigError
from mitex.mesh import Mesh
from tests.methods.nca.text.tiny_text import MeanColour


@pytest.mark.usefixtures("few_patches_of_relief")
def test_a_surface_beside_itself_is_nearer_than_a_rough_one(place):
    pair, ball = ReliefPair("ball.obj", "ball.obj"), Mesh.load("ball.obj")
    noise = np.random.default_rng(0).normal(1, 0.05, (len(ball.vertices), 1))
    same, rough = (
        pair.numbers(clay(mesh), place) for mesh in (ball, ball.with_vertices(noise * ball.vertices))
    )
    assert same.keys() == {measure.key for measure in RELIEFS}
    assert same.pop("relief_size") == rough.pop("relief_size") == 1
    assert same["piercing"] == 0 == rough.pop("piercing")
    assert 0 < pair.floor()["form"] < rough["form"]
    assert same == pytest.approx(dict.fromkeys(same, 0.0), abs=1e-6)
    assert all(value > 0.01 for value in rough.values())


def test_what_the_words_say_scores_high(place, monkeypatch):
    monkeypatch.setattr("mitex.render.sides.AZIMUTHS", (0,))
    monkeypatch.setattr("mitex.render.sides.ELEVATIONS", (0.0,))
    monkeypatch.setattr(text_pair, "judge_of", lambda clip: MeanColour())
    (place / "ball.obj").rename("sphere.obj")
    pair, ball = TextPair("red", "sphere.obj"), Mesh.load("sphere.obj")

    def scores(*rgb):
        albedo = np.tile(np.array(rgb, np.float32), (len(ball.vertices), 1))
        return pair.numbers(Asset(ball, {"albedo": albedo}), place)

    red, blue = scores(1, 0.1, 0.1), scores(0.1, 0.1, 1)
    assert red.keys() == {measure.key for measure in TEXTS}
    for key, value in red.items():
        assert value > blue[key] + 1
        distance = BY_KEY[key].distance
        assert distance is not None and distance(value) < distance(blue[key])


def text_plan(**table):
    content = {"exemplars": ["red bricks", "a. b?"], "meshes": ["vase"], "methods": {"nca": table}}
    return Plan.of(content, ".")


def test_words_are_given_to_the_option_that_takes_them():
    plan = prepared(text_plan(source="text"))
    assert source_of(plan) == "text"
    jobs = jobs_of(plan)
    assert [job.words[job.words.index("--text") + 1] for job in jobs if job.needs is None] == [
        "red bricks",
        "a. b?",
    ]
    assert not any("--exemplar-width" in " ".join(job.words) for job in jobs)


@pytest.mark.parametrize("source", ["txt", "steps", "mesh"])
def test_other_options_take_no_exemplars(source):
    with pytest.raises(ConfigError, match=f"source of methods.nca cannot be '{source}'"):
        text_plan(source=source)
