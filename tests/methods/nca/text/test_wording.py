import pytest
import torch

from mitex.errors import ConfigError
from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.text.wording import check, prompts, with_maps
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
    with pytest.raises(ConfigError, match="text_relief_weight are all 0; let one count"):
        config("text_whole_weight=0", "text_close_weight=0", "text_relief_weight=0")
