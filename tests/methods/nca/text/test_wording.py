import pytest
import torch

from mitex.errors import ConfigError
from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.text.wording import check, prompts, with_maps, worded
from tests.features.clip.folders import write_folder
from tests.methods.nca.text.tiny_text import config
from tests.methods.nca.tiny import texture

MAPS = ("albedo", "ambient_occlusion", "height", "normal")


def test_prompts():
    assert prompts(config(text="moss"), "vase") == ("an image of a vase made of moss", "vase")
    assert prompts(config(text="moss"), "alien")[0] == "an image of an alien made of moss"
    assert prompts(config("text_prompt=a {text} {object}", text="red"), "cup")[0] == "a red a cup"


@pytest.mark.parametrize("shape", [{}, {"shape": None}])
def test_a_look_with_some_of_its_maps_shows_them_as_before(shape):
    whole = texture(MAPS, **shape)
    part = NcaTexture(with_maps(whole.look, ("albedo", "height")), {"name": "part"})
    assert part.look.maps == ("albedo", "height")
    before, after = (t.apply(icosphere(4), resolution=None, steps=4, subdivide=0) for t in (whole, part))
    assert set(after.vertex_maps) == {"albedo", "height"}
    for name, values in after.vertex_maps.items():
        assert torch.allclose(torch.tensor(values), torch.tensor(before.vertex_maps[name]), atol=1e-6)


def test_a_look_without_a_map():
    with pytest.raises(ConfigError, match="the model has no height"):
        with_maps(texture(("albedo",)).look, ("albedo", "height"))


@pytest.mark.parametrize(
    ("settings", "problem"),
    [
        ((), None),
        (("motion=right",), None),
        (("motion=sideways",), "sideways"),
        (("motion=wind.npy",), "of one mesh"),
        (("surfaces=even,uneven,flat", "views=patch"), "flat"),
    ],
)
def test_what_a_training_from_words_cannot_follow(settings, problem):
    if problem is None:
        check(config(*settings))
    else:
        with pytest.raises(ConfigError, match=problem):
            check(config(*settings))


def test_an_empty_text_and_presets_for_exemplars():
    with pytest.raises(ConfigError, match="the text is empty"):
        check(config(text=" "))
    with pytest.raises(ConfigError, match="the preset patch is for exemplars"):
        check(config("order_weight=0", preset="patch"))
    with pytest.raises(ConfigError, match="text_prompt = 'a stone' leaves out the text"):
        config("text_prompt=a stone")


def test_a_text_that_is_given_twice():
    given = {"set": {"text": "red", "motion": "up"}, "preset": "text"}
    assert worded({"preset": "text"}, "red", None, "up") == given
    paper = worded({"set": ["text=red"], "preset": "text-paper"}, "red", "words")
    assert paper == {"set": {"text": "red", "text_model": "words"}, "preset": "text-paper"}
    assert worded({"resume": True}, "red", None).get("preset", "") is None
    with pytest.raises(ConfigError, match="text is set to green and to red; give it once"):
        worded({"set": ["text=green"]}, "red", None)
    with pytest.raises(ConfigError, match="text_model is set to a and to b"):
        worded({"set": {"text_model": "a"}}, "red", "b")
    with pytest.raises(ConfigError, match="motion is set to up and to right"):
        worded({"set": ["motion=up"]}, "red", None, "right")


def test_the_preset_is_the_one_for_the_model(tmp_path, monkeypatch):
    """The embedded one where no CLIP model is named or cached."""
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path / "hub"))
    monkeypatch.delenv("MITEX_CLIP", raising=False)
    clip = str(write_folder(tmp_path / "clip"))
    presets = {name: worded({}, "red", name).get("preset") for name in (None, "words", clip)}
    assert presets == {None: "text-words", "words": "text-words", clip: "text"}
    monkeypatch.setenv("MITEX_CLIP", clip)
    assert worded({}, "red", None).get("preset") == "text"
    assert worded({"set": ["text_model=words"]}, "red", None).get("preset") == "text-words"
