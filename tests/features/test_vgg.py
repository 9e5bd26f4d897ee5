"""The fast VGG-16 against an ordinary float32 network of the same weights."""

import math

import pytest
import torch
import torch.nn.functional as F

from benchmarks.naive import vectors
from mitex.errors import ConfigError
from mitex.features import LAYERS, Vgg16
from mitex.features.frozen import GramTap
from mitex.features.layers import CHANNELS
from mitex.features.vgg import MEAN_ACTIVATION
from mitex.losses import gram_loss, gram_matrix, moment_distance, relaxed_transport
from mitex.methods.nca.config import PRESETS
from tests.features.reference import cosine, exemplars, plain_vgg, relative_error

STYLE = PRESETS["patch"].layers
SIZE = 64


@pytest.fixture(scope="module")
def networks():
    kinds = [(pool, precision) for pool in ("average", "max") for precision in ("float32", "bfloat16")]
    return {kind: Vgg16(*kind) for kind in kinds}


@pytest.fixture(scope="module")
def pictures():
    return exemplars(SIZE)


def _places(network, layers, count, size, n, seed):
    generator = torch.Generator().manual_seed(seed)
    places = {}
    for layer in layers:
        total = math.prod(network.extent(layer, size, size))
        rows = [torch.randperm(total, generator=generator)[:n] for _ in range(count)]
        places[layer] = torch.stack(rows)
    return places


@pytest.mark.parametrize(("precision", "tolerance"), [("float32", 1e-5), ("bfloat16", 1e-2)])
@pytest.mark.parametrize("pool", ["average", "max"])
def test_every_layer_is_that_of_the_plain_network(networks, pictures, pool, precision, tolerance):
    images = pictures[:2, :49, :61]  # odd: pooling drops the last row and column
    ours = networks[pool, precision].features(images, LAYERS)
    plain = plain_vgg(images, pool, MEAN_ACTIVATION[pool])
    for layer in LAYERS:
        assert ours[layer].shape == plain[layer].shape == (2, *_extent(layer), CHANNELS[layer])
        assert ours[layer].dtype == torch.float32
        assert relative_error(ours[layer], plain[layer]) < tolerance, layer


def _extent(layer):
    return {"1": (49, 61), "2": (24, 30), "3": (12, 15), "4": (6, 7), "5": (3, 3)}[layer[4]]


@pytest.mark.parametrize("pool", ["average", "max"])
def test_poolings_and_their_gradient_are_those_of_the_plain_network(networks, pictures, pool):
    """Beside the convolutions that they pool, and alone."""
    reduce = F.avg_pool2d if pool == "average" else F.max_pool2d
    images, reference = (pictures[:1, :49, :61].clone().requires_grad_() for _ in range(2))
    network, sources = networks[pool, "float32"], ("relu1_2", "relu2_2", "relu4_3", "relu5_3")
    ours = network.features(images, ["pool1", "relu2_1", "pool2", "pool4", "relu2_2", "pool5"])
    plain = plain_vgg(reference, pool, MEAN_ACTIVATION[pool])
    pooled = {f"pool{n[4]}": reduce(plain[n].permute(0, 3, 1, 2), 2).permute(0, 2, 3, 1) for n in sources}
    expected = {name: (plain | pooled)[name] for name in ours}
    for name, values in ours.items():
        assert values.shape[1:3] == network.extent(name, 49, 61), name
        assert relative_error(values, expected[name]) < 1e-5, name
    for values in (ours, expected):
        torch.stack([v.square().mean() for v in values.values()]).sum().backward()
    assert images.grad is not None and reference.grad is not None
    assert relative_error(images.grad, reference.grad) < 1e-4


@pytest.mark.parametrize("pool", ["average", "max"])
def test_normalisation_divides_each_layer_by_its_mean(networks, pictures, pool):
    images = pictures[:1]
    plain = Vgg16(pool, "float32", normalised=False).features(images, LAYERS)
    normalised = networks[pool, "float32"].features(images, LAYERS)
    for layer in LAYERS:
        assert relative_error(normalised[layer] * MEAN_ACTIVATION[pool][layer], plain[layer]) < 1e-5


@pytest.mark.parametrize("pool", ["average", "max"])
def test_normalised_layers_are_near_one_on_textures(networks, pool):
    """The recorded means hold for pictures that they were not taken from, within what pictures differ by."""
    means = networks[pool, "float32"].features(exemplars(128), LAYERS)
    for layer in LAYERS:
        assert 0.9 < means[layer].mean() < (1.2 if int(layer[4]) < 4 else 1.65), layer


def _transport_loss(vectors, targets):
    """Relaxed transport and moments as the default preset weighs them."""
    weight = PRESETS["patch"].moment_weight
    parts = [
        relaxed_transport(vectors[k], targets[k]) + weight * moment_distance(vectors[k], targets[k])
        for k in STYLE
    ]
    return torch.stack(parts).mean(1).sum()


def _gram_loss(vectors, targets):
    return gram_loss(vectors, {k: gram_matrix(targets[k]).mean(0) for k in STYLE})


@pytest.mark.parametrize(
    ("pool", "precision", "loss", "loss_error", "least"),
    [
        ("average", "float32", _transport_loss, 1e-5, 1 - 1e-6),
        ("average", "float32", _gram_loss, 1e-5, 1 - 1e-6),
        ("max", "float32", _transport_loss, 1e-5, 1 - 1e-6),
        ("average", "bfloat16", _transport_loss, 1e-3, 0.999),
        # A ReLU or a maximum that rounding flips changes where a gradient goes; Gram matrices of
        # normalised layers live on relu5_3, behind all 13 of them, and maxima flip more often.
        ("average", "bfloat16", _gram_loss, 1e-2, 0.998),
        ("max", "bfloat16", _transport_loss, 1e-3, 0.996),
    ],
)
def test_gradient_of_a_style_loss(networks, pictures, pool, precision, loss, loss_error, least):
    network = networks[pool, precision]
    here, there = (_places(network, STYLE, 2, SIZE, 512, seed) for seed in (1, 2))
    plain = plain_vgg(pictures[2:], pool, MEAN_ACTIVATION[pool])
    targets = vectors(plain, there)
    reference = pictures[:2].clone().requires_grad_()
    expected = loss(vectors(plain_vgg(reference, pool, MEAN_ACTIVATION[pool]), here), targets)
    expected.backward()
    images = pictures[:2].clone().requires_grad_()
    actual = loss(network.samples(images, here), targets)
    actual.backward()
    assert actual.item() == pytest.approx(expected.item(), rel=loss_error)
    assert reference.grad is not None and images.grad is not None
    assert cosine(images.grad, reference.grad) > least
    assert images.grad.norm().item() == pytest.approx(reference.grad.norm().item(), rel=0.02)


@pytest.mark.parametrize("precision", ["float32", "bfloat16"])
def test_samples_are_places_of_the_maps(networks, pictures, precision):
    network = networks["average", precision]
    where = _places(network, ("relu1_2", "relu5_3", "relu3_1"), 4, SIZE, 9, 0)
    maps = network.features(pictures, where)
    samples = network.samples(pictures, where)
    assert list(samples) == list(where)
    for layer, expected in vectors(maps, where).items():
        assert torch.equal(samples[layer], expected)


def test_gradient_of_samples_is_that_of_the_maps(networks, pictures):
    """Also with a place that is sampled twice."""
    network = networks["average", "float32"]
    where = {"relu1_1": torch.tensor([[3, 3, 70]]), "relu3_2": torch.tensor([[0, 255, 17, 17]])}
    gradients = []
    for read in (
        lambda x: network.samples(x, where),
        lambda x: vectors(network.features(x, where), where),
    ):
        x = pictures[:1].clone().requires_grad_()
        torch.stack([v.square().sum() for v in read(x).values()]).sum().backward()
        assert x.grad is not None
        gradients.append(x.grad)
    assert relative_error(*gradients) < 1e-5


@pytest.mark.parametrize(("precision", "tolerance"), [("float32", 1e-5), ("bfloat16", 5e-3)])
def test_gram_matrices_of_regions_are_those_of_the_maps(networks, pictures, precision, tolerance):
    network, gradients = networks["max", precision], []
    regions = {"relu1_1": None, "relu3_2": [torch.arange(100), torch.tensor([7, 200, 7])], "pool4": None}
    taps = {name: GramTap(network.index_of(name), parts) for name, parts in regions.items()}

    def of_maps(images):
        maps = {name: m[0].flatten(0, 1) for name, m in network.features(images, taps).items()}
        parts = {name: regions[name] or [torch.arange(len(rows))] for name, rows in maps.items()}
        return {name: torch.stack([gram_matrix(rows[p]) for p in parts[name]]) for name, rows in maps.items()}

    for read in (lambda x: network.read(x, taps), of_maps):
        x = pictures[:1].clone().requires_grad_()
        grams = read(x)
        torch.stack([gram.square().sum() for gram in grams.values()]).sum().backward()
        gradients.append(x.grad)
    for name, gram in network.read(pictures[:1], taps).items():
        assert gram.shape[0] == len(regions[name] or [None]) and gram.dtype == torch.float32
        assert relative_error(gram, of_maps(pictures[:1])[name]) < tolerance
    assert relative_error(*gradients) < tolerance


def test_gram_matrices_are_of_each_image(networks, pictures):
    network, layers = networks["average", "float32"], ("relu2_1", "relu4_2")
    for count in (1, 3):
        grams = network.grams(pictures[:count], layers)
        for name, maps in network.features(pictures[:count], layers).items():
            assert relative_error(grams[name], gram_matrix(maps.flatten(1, 2))) < 1e-5


def test_images_of_a_batch_do_not_touch_each_other(networks, pictures):
    network = networks["average", "float32"]
    together = network.features(pictures, ["relu4_3"])["relu4_3"]
    alone = torch.cat([network.features(one[None], ["relu4_3"])["relu4_3"] for one in pictures])
    assert relative_error(together, alone) < 1e-5


def test_colours_outside_the_range_are_not_clipped(networks):
    images = torch.tensor([1.2, -0.3, 0.5]).expand(1, 16, 16, 3)
    ours = networks["average", "float32"].features(images, ["relu2_1"])["relu2_1"]
    plain = plain_vgg(images, "average", MEAN_ACTIVATION["average"])["relu2_1"]
    assert relative_error(ours, plain) < 1e-5


def test_only_the_images_carry_a_gradient(networks, pictures):
    assert not networks["average", "float32"].features(pictures, ["relu1_1"])["relu1_1"].requires_grad


@pytest.mark.parametrize(("variable", "dtype"), [("1", torch.bfloat16), ("0", torch.float32)])
def test_precision_follows_the_machine(monkeypatch, variable, dtype):
    monkeypatch.setenv("MITEX_BF16", variable)
    assert Vgg16().dtype == dtype
    assert Vgg16(precision="float32").dtype == torch.float32


@pytest.mark.parametrize(
    ("options", "problem"),
    [({"pool": "mean"}, "pooling 'mean'"), ({"precision": "float16"}, "precision 'float16'")],
)
def test_unknown_options(options, problem):
    with pytest.raises(ConfigError, match=problem):
        Vgg16(**options)


@pytest.mark.parametrize(
    ("shape", "layers", "problem"),
    [
        ((1, 32, 32, 3), ["relu6_1"], "no layer 'relu6_1'"),
        ((1, 32, 32, 3), ["conv1_1"], "no layer 'conv1_1'"),
        ((1, 32, 32, 3), ["pool6"], "no layer 'pool6'"),
        ((1, 32, 32, 3), [], "no VGG-16 layer"),
        ((1, 15, 32, 3), ["relu1_1", "relu5_3"], r"\(15, 32\) are too small for relu5_3"),
        ((1, 3, 32, 32), ["relu1_1"], "shape"),
        ((32, 32, 3), ["relu1_1"], "shape"),
        ((0, 32, 32, 3), ["relu1_1"], "shape"),
    ],
)
def test_unusable_requests(networks, shape, layers, problem):
    with pytest.raises(ConfigError, match=problem):
        networks["average", "float32"].features(torch.rand(shape), layers)


@pytest.mark.parametrize(
    ("positions", "problem"),
    [
        (torch.zeros(1, 4, dtype=torch.long), "shape"),
        (torch.zeros(2, dtype=torch.long), "shape"),
        (torch.tensor([[0], [64]]), "outside"),
        (torch.tensor([[-1], [0]]), "outside"),
    ],
)
def test_unusable_positions(networks, positions, problem):
    """Position 64 of an 8 x 8 map would be the next image's first."""
    with pytest.raises(ConfigError, match=problem):
        networks["average", "float32"].samples(torch.rand(2, 16, 16, 3), {"relu2_2": positions})


def test_smallest_images(networks):
    """16 pixels are one place of relu5_3."""
    assert networks["max", "bfloat16"].features(torch.rand(1, 16, 16, 3), ["relu5_3"])["relu5_3"].shape == (
        1,
        1,
        1,
        512,
    )
