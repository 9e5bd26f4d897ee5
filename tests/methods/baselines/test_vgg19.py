"""Baselines that were published with VGG-19 take a file of it."""

from dataclasses import replace
from typing import Any

import pytest
import torch

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.features.vgg19 import VARIABLE, vgg19_convolutions
from mitex.features.weights import WeightsError
from mitex.mesh import icosphere
from mitex.methods.baselines.gatys.config import PRESETS as GATYS
from mitex.methods.baselines.gatys.task import GatysTask
from mitex.methods.baselines.multi_view_gram.config import PRESETS as MULTI_VIEW
from mitex.methods.baselines.multi_view_gram.task import MultiViewTask
from mitex.methods.baselines.solid_texture.config import PRESETS as SOLID
from mitex.methods.baselines.solid_texture.task import SolidTask
from mitex.methods.baselines.style_mesh.config import PRESETS as STYLE_MESH
from mitex.methods.baselines.style_mesh.task import StyleMeshTask
from mitex.methods.layout import with_layout
from tests.features.test_vgg19 import TORCHVISION, saved

LAYERS = ("relu1_1", "relu3_4")  # VGG-16 has no such second one
STYLE = {"resolution": 32, "exemplar_size": 64, "views": 2, "view": 64, "heights": 1, "textures": 1}
SMALL: dict[str, dict[str, Any]] = {
    "gatys": {"layers": LAYERS, "size": 32, "exemplar_size": 32},
    "solid_texture": {"layers": LAYERS, "slice_size": 32, "exemplar_size": 32, "slices": 1},
    "multi_view_gram": {"layers": LAYERS, "resolution": 32, "exemplar_size": 64, "view": 64},
    "style_mesh": {"layers": LAYERS, "weights": (1.0, 1.0), "small_layers": (), **STYLE},
}
PAPER = {
    "gatys": GATYS["paper"],
    "solid_texture": SOLID["paper"],
    "multi_view_gram": MULTI_VIEW["paper"],
    "style_mesh": STYLE_MESH["paper"],
}
names = pytest.mark.parametrize("name", SMALL)


def task(name: str, exemplar: Exemplar) -> Any:
    config: Any = replace(PAPER[name], network="vgg19", **SMALL[name])
    kinds = {"gatys": GatysTask, "solid_texture": SolidTask}
    if name in kinds:
        return kinds[name](config, exemplar)
    of_mesh = {"multi_view_gram": MultiViewTask, "style_mesh": StyleMeshTask}
    return of_mesh[name](config, exemplar, with_layout(icosphere(2), 32))


@pytest.fixture
def exemplar() -> Exemplar:
    return Exemplar.load("lava").resized(64).of_albedo()


@names
def test_its_layers_are_compared(name, exemplar, tmp_path, monkeypatch):
    path = saved(tmp_path, [f"features.{n}" for n in TORCHVISION])
    monkeypatch.setenv(VARIABLE, str(path))
    own = task(name, exemplar)
    assert tuple(own.targets) == LAYERS and own.targets["relu3_4"].shape == (256, 256)
    expected = vgg19_convolutions(path)["relu3_4"][1]
    bias = own.network.operations[own.network.index_of("relu3_4")].bias
    assert torch.equal(bias, expected.to(bias.dtype))
    assert own.loss(0, torch.Generator().manual_seed(0)).value.isfinite()


def test_gatys_divides_its_layers_by_their_means_on_the_exemplar(exemplar, tmp_path, monkeypatch):
    """So that the loss does not change with the scale of a layer, as that of normalised ones."""
    monkeypatch.setenv(VARIABLE, str(saved(tmp_path, [f"features.{n}" for n in TORCHVISION])))
    own = task("gatys", exemplar)
    picture = own.image.detach()
    (maps,) = own.network.features(picture[None], ["relu3_4"])["relu3_4"]
    target = own.network.features(torch.from_numpy(exemplar.resized(32).maps["albedo"])[None], ["relu3_4"])
    rows, wanted = maps.flatten(0, 1), target["relu3_4"][0].flatten(0, 1)
    rows, wanted = rows / wanted.mean(), wanted / wanted.mean()
    expected = (rows.T @ rows / len(rows) - wanted.T @ wanted / len(wanted)).square().mean() / 4
    own.targets = {"relu3_4": own.targets["relu3_4"]}
    assert float(own.loss(0, torch.Generator()).value.detach()) == pytest.approx(float(expected), rel=1e-3)


def test_multi_view_gram_divides_its_layers_by_their_means(exemplar, tmp_path, monkeypatch):
    """The loss of a layer does not change with its scale, and neither does that of the content."""
    monkeypatch.setenv(VARIABLE, str(saved(tmp_path, [f"features.{n}" for n in TORCHVISION])))
    own = task("multi_view_gram", exemplar)
    own.content = torch.full((32, 32, 3), 0.2)
    value = float(own.loss(0, torch.Generator().manual_seed(0)).value.detach())
    own.means = {layer: 2 * mean for layer, mean in own.means.items()}
    content, own.content = own.content, None
    halved = float(own.loss(0, torch.Generator().manual_seed(0)).value.detach())
    own.means = {layer: mean / 2 for layer, mean in own.means.items()}
    grams = float(own.loss(0, torch.Generator().manual_seed(0)).value.detach())
    assert halved == pytest.approx(grams / 4, rel=1e-5) and value > grams and content is not None
    expected = own.network.features(
        torch.from_numpy(exemplar.resized(own.exemplar_side).maps["albedo"])[None], LAYERS
    )
    assert {layer: own.means[layer] for layer in LAYERS} == pytest.approx(
        {layer: float(maps.mean()) for layer, maps in expected.items()}, rel=0.05
    )


@names
def test_without_a_file(name, exemplar, tmp_path, monkeypatch):
    monkeypatch.setenv(VARIABLE, str(tmp_path / "none.safetensors"))
    with pytest.raises(WeightsError, match="VGG-19 weights are not at"):
        task(name, exemplar)


@names
def test_vgg16_has_fewer_layers(name):
    with pytest.raises(ConfigError, match="relu3_4; use some of"):
        replace(PAPER[name], **SMALL[name])


def test_means_of_vgg19_are_not_known():
    with pytest.raises(ConfigError, match="mean activations of VGG-19 are not known; set normalised=false"):
        replace(SOLID["default"], network="vgg19")
