"""Which channels show what, and what is read from the exemplar."""

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.mesh import icosphere
from mitex.methods.nca.decoder.decoder import Readout
from mitex.methods.nca.decoder.surface import Points, Surface
from mitex.methods.nca.look import Look
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.targets import MOST, Targets, enlarged
from mitex.triples import channel_triples, map_layout

ALL = ["albedo", "ambient_occlusion", "height", "normal", "roughness"]


@pytest.fixture(scope="module")
def network():
    return Vgg16(precision="float32")


@pytest.fixture(scope="module")
def scales():
    return Exemplar.load("scales").resized(32)


def test_values_of_a_state_without_a_decoder():
    """The authors' channels; value = state + 0.5."""
    look, sphere = Look(MeshNCA(), ALL, None), icosphere(1)
    assert isinstance(look.decoder, Readout)
    state = torch.arange(12 * 16, dtype=torch.float32).view(12, 16) / 200 - 0.6
    surface = Surface(sphere, look.interpolation)
    at_corners = Points(torch.arange(20, dtype=torch.int32), torch.eye(3)[torch.arange(20) % 3])
    values = look.decoder(surface, surface.table(state), at_corners)
    own = state[torch.from_numpy(sphere.faces[np.arange(20), np.arange(20) % 3].astype(np.int64))] + 0.5
    expected = {"albedo": [0, 1, 2], "ambient_occlusion": [11], "height": [6], "normal": [7, 8, 9]}
    for name, channels in (expected | {"roughness": [10]}).items():
        assert torch.allclose(values[:, list(look.layout[name])], own[:, channels], atol=1e-6)


def test_targets_read_the_features_of_the_pictures(network, scales):
    layout = map_layout(ALL)
    pictures = channel_triples(layout, True, 0)[:4]
    targets = Targets(scales, pictures, layout, network, ("relu1_1", "relu3_1"))
    grey = torch.from_numpy(
        np.concatenate([scales.maps[name] for name in ("ambient_occlusion", "height", "roughness")], 2)
    )
    order = [(3, 4, 8).index(c) for c in pictures[2].channels]
    images = torch.stack([torch.from_numpy(scales.maps["albedo"]), grey[..., order]])
    maps = network.features(images.flip(0), ["relu3_1"])["relu3_1"]
    assert targets.size("relu3_1") == 64 and targets.size("relu1_1") == targets.size("colour") == 1024
    where = torch.tensor([[0, 63, 9], [17, 17, 1]])
    features = targets.sample("relu3_1", torch.tensor([2, 0]), where)
    for k in range(2):
        assert torch.allclose(features[k], maps[k].flatten(0, 1)[where[k]], atol=1e-5)
    colours = targets.sample("colour", torch.tensor([2]), torch.tensor([[33]]))
    assert torch.equal(colours[0, 0], images[1, 1, 1])


def test_of_a_large_exemplar_some_vectors_are_kept(network):
    """Each once, from everywhere."""
    side = 192
    ramp = np.arange(side * side, dtype=np.float32).reshape(side, side, 1) / side**2
    layout = map_layout(["height"])
    targets = Targets(
        Exemplar({"height": ramp}), channel_triples(layout, True, 0), layout, network, ("relu1_1",)
    )
    assert targets.size("colour") == targets.size("relu1_1") == MOST < side * side
    values = targets.sample("colour", torch.tensor([0]), torch.arange(MOST)[None])[0, :, 0]
    assert len(values.unique()) == MOST
    assert torch.histc(values, 16, 0, 1).min() > 0.95 * MOST / 16


def test_enlarging_is_bilinear():
    ramp = np.array([[0.0, 1.0], [0.0, 1.0]], np.float32)[..., None]
    wide = enlarged(Exemplar({"height": ramp}), 4).maps["height"]
    assert np.allclose(wide[..., 0], [[0, 0.25, 0.75, 1]] * 4)


def test_enlarging_to_the_same_size_changes_nothing(scales):
    assert enlarged(scales, 32) is scales
