"""What is refused, and where models are looked for."""

import json

import pytest
import torch

from mitex.errors import ConfigError, ImageError, WeightsError
from mitex.features.clip import Clip, cached_folder, named_folder
from mitex.features.clip.folder import PUBLIC
from mitex.features.text_model import text_image_model
from tests.features.clip.folders import write_folder


@pytest.fixture(scope="module")
def whole(tmp_path_factory):
    return write_folder(tmp_path_factory.mktemp("clip") / "whole")


@pytest.fixture
def folder(tmp_path):
    return write_folder(tmp_path / "mine")


@pytest.fixture(autouse=True)
def empty_cache(monkeypatch, tmp_path):
    monkeypatch.setenv("HF_HUB_CACHE", str(tmp_path / "hub"))
    monkeypatch.delenv("MITEX_CLIP", raising=False)


def test_it_is_frozen_and_repeats_itself(whole):
    model = Clip(whole)
    images = torch.rand(2, 32, 32, 3, requires_grad=True)
    first = model.encode_images(images)
    first.sum().backward()
    assert first.dtype == torch.float32 and first.shape == (2, 24)
    assert images.grad is not None and images.grad.abs().sum() > 0
    assert all(p.grad is None and not p.requires_grad for p in model._towers.parameters())
    assert torch.equal(Clip(whole).encode_images(images), first)
    assert (model.name, model.resolution) == ("whole", 32)
    assert not model.encode_texts(["red"]).requires_grad and model.encode_texts([]).shape == (0, 24)


def test_texts_do_not_depend_on_their_neighbours(whole):
    model = Clip(whole)
    together = model.encode_texts(["red", "red dots on red dots"])
    alone = torch.cat([model.encode_texts([text]) for text in ("red", "red dots on red dots")])
    assert torch.allclose(together, alone, atol=1e-5)


@pytest.mark.parametrize("text", ["", " \n", "red " * 10_000, "red dots " * 60])
def test_texts_of_no_use(whole, text):
    with pytest.raises(ConfigError, match="the text.*(say|shorten)"):
        Clip(whole).encode_texts(["red", text])


@pytest.mark.parametrize("shape", [(32, 32, 3), (1, 31, 32, 3), (1, 3, 32, 32)])
def test_images_of_other_shapes(whole, shape):
    with pytest.raises(ImageError, match="give .K, 32, 32, 3"):
        Clip(whole).encode_images(torch.zeros(shape))


@pytest.mark.parametrize("name", ["config.json", "model.safetensors", "vocab.json", "merges.txt"])
def test_missing_files_are_named_with_models_that_would_do(folder, name):
    (folder / name).unlink()
    with pytest.raises(WeightsError, match=f"missing is .*{name}") as error:
        text_image_model(folder)
    text = str(error.value)
    assert "\n" not in text and all(model in text for model in PUBLIC) and "MIT, 605 MB" in text


def _change(folder, **changes):
    config = json.loads((folder / "config.json").read_text())
    for key, value in changes.items():
        (config if key in config else config[f"{key.partition('_')[0]}_config"]).update(
            {key if key in config else key.partition("_")[2]: value}
        )
    (folder / "config.json").write_text(json.dumps(config))


@pytest.mark.parametrize(
    ("changes", "problem"),
    [
        ({"model_type": "siglip"}, "siglip"),
        ({"vision_image_size": 33}, "no multiple of patch_size"),
        ({"vision_hidden_size": 66}, "66 cannot be split"),
        ({"vision_hidden_size": "64"}, "hidden_size = '64'"),
        ({"vision_hidden_act": "relu"}, "relu"),
        ({"text_num_hidden_layers": 0}, "num_hidden_layers = 0"),
        ({"projection_dim": True}, "projection_dim = True"),
        ({"text_config": [1]}, "describe"),
        ({"text_vocab_size": 100}, "the tokenizer .* is not that of its model"),
        ({"text_eos_token_id": 3}, "the tokenizer .* is not that of its model"),
        ({"vision_num_hidden_layers": 3}, "does not fit its config.json: vision_model.encoder.layers.2"),
        ({"projection_dim": 25}, "does not fit its config.json: visual_projection"),
    ],
)
def test_configs_of_other_models(folder, changes, problem):
    _change(folder, **changes)
    with pytest.raises(WeightsError, match=problem):
        Clip(folder)


def test_more_layers_than_the_config_says_are_left_out_only_if_the_rest_fits(folder):
    _change(folder, vision_num_hidden_layers=1)
    assert Clip(folder).encode_images(torch.zeros(1, 32, 32, 3)).shape == (1, 24)


@pytest.mark.parametrize(
    ("name", "content", "problem"),
    [
        ("config.json", b"{", "config.json is not JSON"),
        ("config.json", b"[1]", "config.json is no table"),
        ("preprocessor_config.json", b'{"image_std": [0, 1, 1]}', "image_std"),
        ("preprocessor_config.json", b'{"image_mean": 0.5}', "describe"),
        ("vocab.json", b"{}", "tokenizer .* cannot be read"),
        ("merges.txt", b"re d", "tokenizer .* cannot be read"),
        ("tokenizer.json", b"{}", "tokenizer .* cannot be read"),
        ("model.safetensors", b"damaged", "model.safetensors cannot be read"),
    ],
)
def test_damaged_files(folder, name, content, problem):
    (folder / name).write_bytes(content)
    with pytest.raises(WeightsError, match=problem):
        Clip(folder)


def test_weights_cut_short_or_not_finite(folder):
    from safetensors.torch import load_file, save_file

    path = folder / "model.safetensors"
    tensors = load_file(path)
    path.write_bytes(path.read_bytes()[:-100])
    with pytest.raises(WeightsError, match="cannot be read"):
        Clip(folder)
    tensors["visual_projection.weight"][0, 0] = torch.nan
    save_file(tensors, path)
    with pytest.raises(WeightsError, match="not finite"):
        Clip(folder)


def test_half_precision_files_are_read(folder):
    from safetensors.torch import load_file, save_file

    images, path = torch.rand(1, 32, 32, 3), folder / "model.safetensors"
    expected = Clip(folder, "float32").encode_images(images)
    save_file({name: value.half() for name, value in load_file(path).items()}, path)
    assert torch.allclose(Clip(folder, "float32").encode_images(images), expected, atol=0.02)


def test_where_models_are_looked_for(whole, tmp_path, monkeypatch):
    assert named_folder() is None and cached_folder() is None
    name = list(PUBLIC)[1]
    cached = tmp_path / "hub" / f"models--{name.replace('/', '--')}" / "snapshots" / "abc"
    write_folder(cached)
    assert cached_folder() == cached and text_image_model().name == name
    assert named_folder(name) == cached
    monkeypatch.setenv("MITEX_CLIP", str(whole))
    assert named_folder() == whole and text_image_model().name == "whole"
    assert text_image_model(name).name == name
    (cached / "model.safetensors").unlink()
    monkeypatch.delenv("MITEX_CLIP")
    assert cached_folder() is None
    with pytest.raises(WeightsError, match="missing is model.safetensors"):
        named_folder(name)
    with pytest.raises(WeightsError, match="missing is the folder itself"):
        text_image_model("nowhere")


def test_unknown_precision(whole):
    with pytest.raises(ConfigError, match="int8"):
        Clip(whole, "int8")
