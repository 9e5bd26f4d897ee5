"""The embedded vision-language model as it ships: what it tells apart, its gradients, its file."""

import pytest
import torch
import torch.nn.functional as F

from mitex.errors import ConfigError, ImageError, WeightsError
from mitex.features import weights
from mitex.features.text_image import TextImageModel
from mitex.features.text_model import EMBEDDED, text_image_model
from mitex.features.words import WordsModel, model, words_model
from mitex.features.words.network import WordsNetwork
from tests.features.words.pictures import COLOURS, PATTERNS, picture


@pytest.fixture(scope="module")
def shipped() -> TextImageModel:
    return words_model()


def cosines(shipped: TextImageModel, images: list[torch.Tensor], texts: list[str]) -> torch.Tensor:
    pictures = F.normalize(shipped.encode_images(torch.stack(images)), dim=1)
    return pictures @ F.normalize(shipped.encode_texts(texts), dim=1).T


def test_patterns_and_colours_of_other_formulas(shipped):
    pairs = [("red", "white"), ("yellow", "black"), ("white", "blue"), ("black", "green")]
    named = [(pattern, *pair) for pattern in PATTERNS for pair in pairs]
    table = cosines(shipped, [picture(*n) for n in named], [f"{f} {p} on {g}" for p, f, g in named])
    assert (table.argmax(1) == torch.arange(len(named))).float().mean() > 0.9


def test_the_order_of_words_matters(shipped):
    pairs = [(a, b) for a in COLOURS for b in COLOURS if a != b]
    images = [picture("dots", figure, ground) for figure, ground in pairs]
    table = cosines(shipped, images, [f"{f} dots on {g}" for f, g in pairs])
    swapped = cosines(shipped, images, [f"{g} dots on {f}" for f, g in pairs])
    assert (table.diagonal() > swapped.diagonal()).float().mean() > 0.9


def test_other_words_for_the_same(shipped):
    texts = ["red dots on white", "a picture of crimson spots over a white background", "white with red dots"]
    same, synonyms, turned, reverse = shipped.encode_texts([*texts, "white dots on red"])
    assert torch.allclose(same, synonyms, atol=1e-5)
    assert F.cosine_similarity(same, turned, dim=0) > F.cosine_similarity(same, reverse, dim=0) + 0.01


def test_texts_do_not_depend_on_what_they_are_encoded_with(shipped):
    alone = shipped.encode_texts(["lava"])
    together = shipped.encode_texts(["small red dots on white with blue", "lava"])
    assert torch.allclose(alone[0], together[1], atol=1e-5)
    assert torch.equal(alone, WordsModel(words_model().network).encode_texts(["lava"]))


def test_pictures_are_encoded_alone_and_the_same_each_time(shipped):
    images = torch.stack([picture("dots", "red", "white"), picture("grid", "blue", "black")])
    both = shipped.encode_images(images)
    assert both.shape == (2, shipped.encode_texts(["red"]).shape[1])
    assert torch.equal(both, shipped.encode_images(images))
    assert torch.allclose(both[1:], shipped.encode_images(images[1:]), atol=1e-4)


def test_gradients_are_those_of_finite_differences():
    network = WordsNetwork().double()
    network.load_state_dict(words_model().network.state_dict())
    double = WordsModel(network)
    generator = torch.Generator().manual_seed(0)
    image = torch.rand(1, 64, 64, 3, generator=generator, dtype=torch.float64).requires_grad_()
    direction = torch.randn(image.shape, generator=generator, dtype=torch.float64)
    meant = double.encode_texts(["red dots on white"])
    assert not meant.requires_grad

    def cosine(x: torch.Tensor) -> torch.Tensor:
        return F.cosine_similarity(double.encode_images(x), meant).sum()

    (gradient,) = torch.autograd.grad(cosine(image), image)
    ahead, behind = (cosine(image.detach() + s * 1e-5 * direction) for s in (1, -1))
    assert (gradient * direction).sum().item() == pytest.approx((ahead - behind).item() / 2e-5, rel=1e-5)


def test_it_is_frozen_and_tells_its_size(shipped):
    assert not any(parameter.requires_grad for parameter in words_model().network.parameters())
    assert shipped.resolution == 64 and "CLIP" not in shipped.name


def test_unknown_words(shipped):
    with pytest.raises(ConfigError, match="did you mean white?"):
        shipped.encode_texts(["red dots on whyte"])


@pytest.mark.parametrize("shape", [(64, 64, 3), (1, 3, 64, 64), (1, 32, 64, 3)])
def test_other_shapes(shipped, shape):
    with pytest.raises(ImageError, match="shape"):
        shipped.encode_images(torch.zeros(shape))


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """An empty folder of weights, with nothing loaded before or after."""
    monkeypatch.setattr(weights, "FOLDER", tmp_path)
    model.words_model.cache_clear()
    yield tmp_path
    model.words_model.cache_clear()


def test_no_weights(folder):
    with pytest.raises(WeightsError, match="not at"):
        words_model()


@pytest.mark.parametrize("damage", ["bit", "cut"])
def test_other_weights(folder, damage):
    original = weights.Path(weights.__file__).parents[1] / "data" / "weights" / weights.WORDS_FILE
    content = bytearray(original.read_bytes())
    content[len(content) // 2] ^= 1
    (folder / weights.WORDS_FILE).write_bytes(content if damage == "bit" else content[:1000])
    with pytest.raises(WeightsError, match="not the expected file"):
        words_model()


def test_the_file_is_small_and_tells_how_it_was_made():
    from safetensors import safe_open

    path = weights.shipped(weights.WORDS_FILE)
    assert path.stat().st_size < 5_000_000
    with safe_open(path, "pt") as file:
        about = file.metadata()
    assert int(about["training_steps"]) > 1000
    assert float(about["text_among_100"]) > 0.9 and float(about["picture_among_100"]) > 0.9


def test_on_another_device():
    """The device without values stands in for a graphics card."""
    model = text_image_model(EMBEDDED, device="meta")
    pictures = torch.zeros(2, 64, 64, 3, device="meta")
    for vectors in (model.encode_images(pictures), model.encode_texts(["red dots", "blue"])):
        assert vectors.device.type == "meta" and vectors.shape == (2, 128)
