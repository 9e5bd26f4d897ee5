"""The training of the vision-language model: true captions, pictures of what they say, a file of weights."""

import sys
from dataclasses import replace
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
import torch
from safetensors import safe_open

from mitex.features.words import concepts, words_model
from mitex.features.words.vocabulary import LONGEST, PATTERNS

TOOLS = Path(__file__).parents[2] / "tools"
MODULES = (
    "word_augmentation",
    "word_captions",
    "word_materials",
    "word_patterns",
    "word_pictures",
    "word_places",
    "word_retrieval",
    "word_shapes",
    "word_tilings",
    "train_words",
)


@pytest.fixture
def tool(monkeypatch):
    """Imports a module of the folder of tools."""
    monkeypatch.syspath_prepend(str(TOOLS))
    for name in MODULES:
        monkeypatch.delitem(sys.modules, name, raising=False)
    return import_module


def drawn(tool, count: int) -> list:
    rng = np.random.default_rng(0)
    return [tool("word_pictures").draw_subject(rng) for _ in range(count)]


def test_every_pattern_has_a_word(tool):
    assert sorted(tool("word_patterns").KINDS) == sorted(PATTERNS)


def test_captions_are_true_of_their_subjects_and_known_to_the_model(tool):
    captions, rng = tool("word_captions"), np.random.default_rng(1)
    subjects = drawn(tool, 300)
    said = [captions.describe(subject, rng) for subject in subjects]
    assert captions.true_of(said, subjects).diagonal().all()
    for caption in said:
        assert concepts(" ".join(caption.concepts)) == caption.concepts
        assert len(caption.concepts) <= LONGEST


def test_full_captions_are_true_of_no_other_subject(tool):
    captions, rng = tool("word_captions"), np.random.default_rng(1)
    subjects = drawn(tool, 100)
    changed = [captions.other(subject, rng) for subject in subjects]
    said = [captions.Caption([], {key: getattr(s, key) for key in captions.VALUES}) for s in subjects]
    assert captions.true_of(said, subjects).diagonal().all()
    assert not captions.true_of(said, changed).diagonal().any()


def test_stripes_may_be_said_either_way_and_dots_may_not(tool):
    captions, subject = tool("word_captions"), tool("word_pictures").Subject("stripes", "red", "white")
    for kind, either in (("stripes", True), ("dots", False)):
        shown = replace(subject, kind=kind)
        said = {key: getattr(replace(shown, figure="white", ground="red"), key) for key in captions.VALUES}
        assert captions.true_of([captions.Caption([], said)], [shown]).item() == either


def test_pictures_have_their_colours_and_as_many_dots_as_their_scale_says(tool):
    pictures = tool("word_pictures")
    subject = pictures.Subject("dots", "red", "white", material="")
    counts = {}
    for scale in pictures.SCALES:
        images = pictures.render([replace(subject, scale=scale)] * 8, 80, seed=0) / 255.0
        red = (images[..., 0] - images[..., 1] > 0.3).mean((1, 2))
        white = (images.min(-1) > 0.6).mean((1, 2))
        assert (red > 0.08).all() and (red < 0.6).all() and (red + white > 0.6).all()
        edges = np.abs(np.diff((images[..., 0] - images[..., 1] > 0.3).astype(float), axis=2)).sum((1, 2))
        counts[scale] = edges.mean()
    assert counts["small"] > 1.4 * counts["medium"] > 1.4 * 1.4 * counts["large"]


def test_a_ball_lies_on_a_background(tool):
    pictures = tool("word_pictures")
    (image,) = pictures.render([pictures.Subject("plain", "red", "red", ball=True)], 64, seed=1) / 255.0
    corners = image[[0, 0, -1, -1], [0, -1, 0, -1]]
    assert np.ptp(corners, 0).max() < 0.01 and np.abs(image[32, 32] - corners[0]).max() > 0.2


def test_augmented_pictures_differ_and_stay_in_range(tool):
    images = torch.rand(4, 3, 80, 80, generator=torch.Generator().manual_seed(0))
    first, second = (
        tool("word_augmentation").augmented(images, 64, torch.Generator().manual_seed(s)) for s in (0, 1)
    )
    assert first.shape == (4, 3, 64, 64) and first.min() >= 0 and first.max() <= 1
    assert (first - second).abs().mean() > 0.05


def test_held_out_combinations_are_not_trained_on(tool):
    trained = tool("train_words").subjects(500)
    held = tool("word_retrieval").held_out(20, seed=0)
    assert not any(subject.held_out for subject in trained) and all(subject.held_out for subject in held)


def test_shipped_weights_find_the_text_of_held_out_pictures(tool):
    found, seen = tool("word_retrieval").among_hundred(words_model().network, seed=7)
    assert found > 0.9 and seen > 0.9


def test_from_pictures_to_a_file_of_weights(tool, monkeypatch, tmp_path, capsys):
    script, retrieval = tool("train_words"), tool("word_retrieval")
    monkeypatch.setattr(retrieval, "CHOICES", 4)
    monkeypatch.setattr(retrieval, "REPEATS", 1)
    monkeypatch.setattr(script, "FOLDER", tmp_path)
    script.draw(tmp_path / "pictures.npy", 40)
    for steps in (2, 3):  # one on fresh pictures, one on misled ones, and one more
        config = script.Config(steps=steps, batch=4)
        script.learn(tmp_path / "pictures.npy", tmp_path / "run", config, resume=steps == 3)
    script.finish(tmp_path / "run")
    assert "text among 100" in capsys.readouterr().out
    with safe_open(tmp_path / "words.safetensors", "pt") as file:
        assert file.metadata()["training_steps"] == "3"
        assert file.get_tensor("image.out.bias").dtype == torch.float16
