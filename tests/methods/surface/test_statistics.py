"""The exemplar's features: those of the image network, without its border."""

import pytest
import torch
import torch.nn.functional as F

from mitex.features import Vgg16
from mitex.features.layers import LAYERS, with_poolings
from mitex.methods.surface.statistics import exemplar_features


@pytest.fixture(scope="module")
def image():
    return torch.rand(64, 96, 3, generator=torch.Generator().manual_seed(0))


@pytest.mark.parametrize("pool", ["average", "max"])
def test_features_are_those_of_a_mirrored_image(image, pool):
    """Of a picture so large that its zeros are far away."""
    network = Vgg16(pool, precision="float32", normalised=False)
    features = exemplar_features(network, image, ("relu1_2", "pool1", "relu2_2", "pool2"))
    assert {name: f.shape for name, f in features.items()} == {
        "relu1_2": (64 * 96, 64),
        "pool1": (32 * 48, 64),
        "relu2_2": (32 * 48, 128),
        "pool2": (16 * 24, 128),
    }
    rows = torch.cat([image.flip(0)[:-1], image, image.flip(0)[1:]])
    whole = torch.cat([rows.flip(1)[:, :-1], rows, rows.flip(1)[:, 1:]], 1)[None, 63 - 32 :, 95 - 32 :]
    maps = network.features(whole, ["relu1_2", "relu2_2"])
    cut = maps["relu2_2"][0, 16 : 16 + 32, 16 : 16 + 48].flatten(0, 1)
    assert torch.allclose(features["relu2_2"], cut, atol=1e-3 * float(cut.max()))
    reduce = F.avg_pool2d if pool == "average" else F.max_pool2d
    pooled = reduce(maps["relu1_2"].permute(0, 3, 1, 2), 2)[0, :, 16 : 16 + 32, 16 : 16 + 48]
    assert torch.allclose(features["pool1"], pooled.flatten(1).T, atol=1e-3 * float(pooled.max()))


def test_a_constant_image_has_the_same_features_everywhere():
    network = Vgg16(precision="float32", normalised=False)
    for layer, f in exemplar_features(network, torch.full((64, 64, 3), 0.4), with_poolings(LAYERS)).items():
        if layer[4] in "123":  # the deepest ones see the zeros beyond the margin
            assert torch.allclose(f, f[:1].expand_as(f), atol=1e-3 * float(f.max())), layer


def test_tiny_images_have_all_layers():
    features = exemplar_features(Vgg16(normalised=False), torch.rand(16, 16, 3), with_poolings(LAYERS))
    assert features["pool5"].shape[1] == 512 and all(len(f) and f.isfinite().all() for f in features.values())
