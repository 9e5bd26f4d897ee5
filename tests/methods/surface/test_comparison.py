"""How textures are compared with an exemplar."""

import pytest
import torch

from mitex.features import Vgg16
from mitex.losses import gram_matrix
from mitex.methods.surface.comparison import MIN_VECTORS, GramComparison, TransportComparison
from mitex.methods.surface.network import SurfaceVgg
from mitex.methods.surface.statistics import exemplar_features
from tests.losses import authors
from tests.methods.surface.grids import grid_levels

SIDE = 64
LAYER = "relu1_1"


@pytest.fixture(scope="module")
def network():
    return SurfaceVgg(grid_levels(SIDE), precision="float32")


@pytest.fixture(scope="module")
def image():
    return torch.rand(SIDE, SIDE, 3, generator=torch.Generator().manual_seed(1))


def cost(network, colours, image, layers, region):
    comparison = GramComparison(Vgg16(precision="float32", normalised=False), image[None], layers, region)
    generator = torch.Generator()
    features = network.read(colours, comparison.taps(network, generator))
    return comparison.cost(features, colours, 0, generator)


def test_regions_are_compared_one_by_one(network, image):
    """The mean over quarters of the texels of their own distances."""
    colours = torch.rand(SIDE**2, 3, generator=torch.Generator().manual_seed(2))
    target = gram_matrix(
        exemplar_features(Vgg16(precision="float32", normalised=False), image, (LAYER,))[LAYER]
    )
    features = network.features(colours, [LAYER])[LAYER]
    quarters = [features[region] for region in network.regions(LAYER, 4)]
    expected = torch.stack([(gram_matrix(f) - target).square().mean() for f in quarters]).mean()
    assert cost(network, colours, image, (LAYER,), SIDE**2 // 4) == pytest.approx(float(expected), rel=1e-4)


def test_only_regions_see_that_contrast_is_uneven(network):
    """A texture equal to its exemplar, strong in one half and flat in the other."""
    uneven = torch.rand(SIDE, SIDE, 3, generator=torch.Generator().manual_seed(3))
    uneven[SIDE // 2 :] = 0.5
    colours = uneven.view(-1, 3)[grid_levels(SIDE).order]
    whole, parts = (cost(network, colours, uneven, (LAYER,), region) for region in (None, SIDE**2 // 4))
    assert parts > 20 * whole


def test_regions_of_deep_layers_hold_enough_elements(network, image):
    comparison = GramComparison(
        Vgg16(precision="float32", normalised=False), image[None], (LAYER, "relu2_1", "relu4_1"), 256
    )
    taps = comparison.taps(network, torch.Generator())
    counts = [1 if tap.regions is None else len(tap.regions) for tap in taps.values()]
    assert counts == [SIDE**2 // 256, SIDE**2 // 4 // MIN_VECTORS, 1]


def test_transport_compares_colours_as_the_authors_do(image):
    """Without features the colours are left; places are drawn of the texels first, then of the exemplar."""
    comparison = TransportComparison(Vgg16(precision="float32"), image[None], (LAYER,), 500, 0.1)
    colours = torch.rand(900, 3, generator=torch.Generator().manual_seed(2))
    colours[::2] = 0  # black has a direction like any other colour
    cost = comparison.cost({}, colours, 0, torch.Generator().manual_seed(5))
    generator = torch.Generator().manual_seed(5)
    ours, theirs = (torch.randint(n, (500,), generator=generator) for n in (900, SIDE**2))
    expected = authors.colour_cost(colours[ours].numpy(), image.view(-1, 3)[theirs].numpy())
    assert cost.item() == pytest.approx(expected, rel=1e-4)
