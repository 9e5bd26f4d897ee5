"""How fits from words begin, whatever the method."""

import pytest

from mitex.errors import ConfigError
from mitex.methods.words.wording import check_text, words_options
from tests.features.clip.folders import write_folder


def test_a_text_that_is_given_twice():
    given = {"set": {"text": "red", "motion": "up"}, "preset": "text"}
    assert words_options({"preset": "text"}, {"text": "red", "text_model": None, "motion": "up"}) == given
    paper = words_options(
        {"set": ["text=red"], "preset": "text-paper"}, {"text": "red", "text_model": "words"}
    )
    assert paper == {"set": {"text": "red", "text_model": "words"}, "preset": "text-paper"}
    assert words_options({"resume": True}, {"text": "red"}).get("preset", "") is None
    with pytest.raises(ConfigError, match="text is set to green and to red; give it once"):
        words_options({"set": ["text=green"]}, {"text": "red"})
    with pytest.raises(ConfigError, match="text_model is set to a and to b"):
        words_options({"set": {"text_model": "a"}}, {"text": "red", "text_model": "b"})
    with pytest.raises(ConfigError, match="motion is set to up and to right"):
        words_options({"set": ["motion=up"]}, {"motion": "right"})


def test_the_preset_is_the_one_for_the_model(tmp_path, monkeypatch):
    """The embedded one where no CLIP model is named or cached."""
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path / "hub"))
    monkeypatch.delenv("MITEX_CLIP", raising=False)
    clip = str(write_folder(tmp_path / "clip"))
    presets = {name: words_options({}, {"text_model": name}).get("preset") for name in (None, "words", clip)}
    assert presets == {None: "text-words", "words": "text-words", clip: "text"}
    monkeypatch.setenv("MITEX_CLIP", clip)
    assert words_options({}, {"text": "red"}).get("preset") == "text"
    assert words_options({"set": ["text_model=words"]}, {"text": "red"}).get("preset") == "text-words"


@pytest.mark.parametrize(
    ("text", "preset", "problem"),
    [(" ", "text", "the text is empty"), (None, "text", "empty"), ("red", "paper", "paper is for exemplars")],
)
def test_what_is_not_for_words(text, preset, problem):
    check_text("red", "text")
    with pytest.raises(ConfigError, match=problem):
        check_text(text, preset)
