"""Our CLIP against that of the library transformers, on folders with random weights."""

import json

import pytest
import torch

from mitex.features.clip import Clip
from mitex.features.clip.towers import Linear
from tests.features.clip.folders import END, MERGES, SHAPES, START, vocabulary, write_folder
from tests.features.reference import cosine

TEXTS = ["red dots on red", "A", "it's 42 RED  dots!!", "caf\u00e9 \u2603"]


@pytest.fixture(scope="module")
def transformers():
    import transformers  # takes seconds

    return transformers


@pytest.fixture(scope="module", params=SHAPES)
def both(transformers, request, tmp_path_factory):
    """A folder, our model and theirs."""
    folder = write_folder(tmp_path_factory.mktemp("clip") / request.param, request.param)
    theirs = transformers.CLIPModel.from_pretrained(folder, local_files_only=True)
    return folder, Clip(folder, precision="float32"), theirs.eval()


def _pooled(output):
    return output if isinstance(output, torch.Tensor) else output.pooler_output


def test_images_and_their_gradients(both):
    _, ours, theirs = both
    images = torch.rand(3, ours.resolution, ours.resolution, 3, generator=torch.Generator().manual_seed(1))
    images.requires_grad_()
    mean, deviation = (torch.tensor(v) for v in (ours._shape.mean, ours._shape.deviation))
    pixels = ((images - mean) / deviation).permute(0, 3, 1, 2)
    expected = _pooled(theirs.get_image_features(pixel_values=pixels))
    actual = ours.encode_images(images)
    assert torch.allclose(actual, expected, atol=1e-5, rtol=1e-5)
    own, other = (torch.autograd.grad(value.sin().sum(), images)[0] for value in (actual, expected))
    assert torch.allclose(own, other, atol=1e-5 * other.abs().max().item())


def test_texts(both, transformers):
    folder, ours, theirs = both
    ids = vocabulary()
    fast = transformers.CLIPTokenizer(
        vocab=ids, merges=[tuple(merge.split()) for merge in MERGES], bos_token=START, eos_token=END
    )
    tokens = fast(TEXTS, padding=True, return_tensors="pt")
    own, last = ours._tokenizer(TEXTS)
    assert torch.equal(own, tokens["input_ids"])
    assert torch.equal(last, tokens["attention_mask"].sum(1) - 1)
    expected = _pooled(theirs.get_text_features(**tokens))
    assert torch.allclose(ours.encode_texts(TEXTS), expected, atol=1e-5, rtol=1e-5)
    fast.save_pretrained(folder)  # with a tokenizer.json, which comes first
    (folder / "vocab.json").write_text("damaged")
    assert torch.equal(Clip(folder, precision="float32")._tokenizer(TEXTS)[0], own)


def test_configs_from_before_2023_end_texts_with_the_last_token(transformers, tmp_path):
    folder = write_folder(tmp_path / "clip", end=2)
    theirs = transformers.CLIPModel.from_pretrained(folder, local_files_only=True).eval()
    ours = Clip(folder, precision="float32")
    tokens, _ = ours._tokenizer(["red dots", "a"])
    expected = _pooled(theirs.get_text_features(input_ids=tokens))
    assert torch.allclose(ours.encode_texts(["red dots", "a"]), expected, atol=1e-5, rtol=1e-5)


def test_bfloat16_gives_the_gradient_of_float32(tmp_path):
    folder = write_folder(tmp_path / "clip", "wide", layers=6)
    images = torch.rand(4, 64, 64, 3, generator=torch.Generator().manual_seed(1), requires_grad=True)
    values = []
    for precision in ("float32", "bfloat16"):
        model = Clip(folder, precision)
        text = model.encode_texts(["red dots"])
        loss = torch.cosine_similarity(model.encode_images(images), text).sum()
        values.append(torch.autograd.grad(loss, images)[0])
    assert not torch.equal(*values) and cosine(*values) > 0.999


@pytest.mark.parametrize(
    ("fast", "sharp", "expected"), [(True, 1, "bfloat16"), (True, 20, "float32"), (False, 1, "float32")]
)
def test_bfloat16_where_processor_and_weights_allow_it(tmp_path, monkeypatch, fast, sharp, expected):
    """Not where attention is so sharp that its choice depends on the last bits."""
    from safetensors.torch import load_file, save_file

    monkeypatch.setattr("mitex.runtime.precision.bfloat16_is_fast", lambda device: fast)
    path = write_folder(tmp_path / "clip", "wide", layers=6) / "model.safetensors"
    weights = load_file(path)
    save_file({name: sharp * w if "q_proj.weight" in name else w for name, w in weights.items()}, path)
    layers = [part for part in Clip(path.parent)._towers.vision_model.modules() if isinstance(part, Linear)]
    assert {str(layer.weight.dtype) for layer in layers} == {f"torch.{expected}"}


def test_colours_are_normalised_as_the_folder_says(tmp_path):
    folder = write_folder(tmp_path / "clip")
    images = torch.rand(1, 32, 32, 3, generator=torch.Generator().manual_seed(1))
    default = Clip(folder, "float32")
    mean, deviation = (torch.tensor(v) for v in (default._shape.mean, default._shape.deviation))
    (folder / "preprocessor_config.json").write_text(
        json.dumps({"image_mean": [0.5, 0.5, 0.5], "image_std": [0.5, 0.25, 0.5]})
    )
    other = Clip(folder, "float32")
    same = ((images - torch.tensor(0.5)) / torch.tensor([0.5, 0.25, 0.5])) * deviation + mean
    assert torch.allclose(other.encode_images(images), default.encode_images(same), atol=1e-5)
