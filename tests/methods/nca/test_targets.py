"""Which channels show what, and what is read from the exemplar."""

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.methods.nca.targets import Targets, enlarged, state_layout, state_maps
from mitex.triples import channel_triples

ALL = ["albedo", "ambient_occlusion", "height", "normal", "roughness"]


@pytest.fixture(scope="module")
def network():
    return Vgg16(precision="float32")


@pytest.fixture(scope="module")
def scales():
    return Exemplar.load("scales").resized(32)


def test_maps_of_a_state():
    """The authors' channels; value = state + 0.5, clipped."""
    state = np.arange(16, dtype=np.float32)[None] / 20 - 0.55
    state[0, 1] = -0.9
    state[0, 11] = 0.8
    maps = state_maps(state, ALL)
    assert list(maps) == ALL
    assert np.allclose(maps["albedo"], [[0, 0, 0.05]])
    assert np.allclose(maps["height"], [[0.25]])
    assert np.allclose(maps["normal"], [[0.3, 0.35, 0.4]])
    assert np.allclose(maps["roughness"], [[0.45]])
    assert np.allclose(maps["ambient_occlusion"], [[1]])
    assert list(state_maps(state, ["height"])) == ["height"]


def test_targets_read_the_features_of_the_pictures(network, scales):
    pictures = channel_triples(state_layout(ALL), True, 0)[:4]
    targets = Targets(scales, pictures, network, ("relu1_1", "relu3_1"))
    grey = torch.from_numpy(
        np.concatenate([scales.maps[name] for name in ("ambient_occlusion", "height", "roughness")], 2)
    )
    order = [{11: 0, 6: 1, 10: 2}[c] for c in pictures[2].channels]
    assert torch.equal(targets.images[2], grey[..., order])
    maps = network.features(targets.images[[2, 0]], ["relu3_1"])["relu3_1"]
    assert targets.size("relu3_1") == 64 and targets.size("relu1_1") == targets.size("colour") == 1024
    where = torch.tensor([[0, 63, 9], [17, 17, 1]])
    features = targets.sample("relu3_1", torch.tensor([2, 0]), where)
    for k in range(2):
        assert torch.allclose(features[k], maps[k].flatten(0, 1)[where[k]], atol=1e-5)
    colours = targets.sample("colour", torch.tensor([1]), torch.tensor([[33]]))
    assert torch.equal(colours[0, 0], targets.images[1, 1, 1])


def test_enlarging_is_bilinear():
    ramp = np.array([[0.0, 1.0], [0.0, 1.0]], np.float32)[..., None]
    wide = enlarged(Exemplar({"height": ramp}), 4).maps["height"]
    assert np.allclose(wide[..., 0], [[0, 0.25, 0.75, 1]] * 4)


def test_enlarging_to_the_same_size_changes_nothing(scales):
    assert enlarged(scales, 32) is scales
