"""The surface network against the image network, and its gradients against dense references."""

import math
from functools import cache

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.features import Vgg16
from mitex.features.frozen import GramTap
from mitex.features.layers import LAYERS
from mitex.features.vgg import convolutions
from mitex.methods.surface import operations as room
from mitex.methods.surface.exponential import GeodesicTracer
from mitex.methods.surface.levels import Level
from mitex.methods.surface.network import SurfaceVgg
from mitex.methods.surface.operations import Kernel, Neighbourhood, SurfaceConv, SurfacePool
from mitex.methods.surface.taps import Surroundings, build
from mitex.methods.surface.weights import random_weights
from mitex.texels import Texels
from tests.mesh.examples import tangent_frames
from tests.methods.surface.grids import flat_square, grid_levels

SIDE = 224  # of which two elements of the last layers are out of reach of the border's rule
SMALL = 128  # of which two elements of the fourth block's are
MARGIN = {1: 2, 2: 3, 3: 5, 4: 6, 5: 6}  # how far the border's rule reaches into the layers of a block


@pytest.fixture(scope="module")
def levels():
    return grid_levels(SIDE)


@pytest.fixture(scope="module")
def traced_levels():
    return traced(SIDE)


@pytest.fixture(scope="module")
def small_traced_levels():
    return traced(SMALL)


def traced(side):
    """The levels of a flat square of triangles whose atlas is the identity."""
    mesh = flat_square(40)
    assert mesh.uv is not None
    texels = Texels.rasterize(mesh, mesh.uv, side)
    frames = tangent_frames(mesh, texels.face, texels.barycentric, "fixed")
    return build(Surroundings(texels, GeodesicTracer(mesh), *frames))


@pytest.fixture(scope="module")
def image():
    return random_image(SIDE)


@pytest.fixture(scope="module")
def small_levels():
    return grid_levels(SMALL)


@pytest.fixture(scope="module")
def small_image():
    return random_image(SMALL)


def random_image(side):
    return torch.rand(side, side, 3, generator=torch.Generator().manual_seed(0))


def as_image(levels, values, layer):
    """(n, C) elements of a layer as an image (h, w, C)."""
    n, side = int(layer[4]) - 1, math.isqrt(len(levels.order))
    width = side >> n
    row, column = np.divmod(levels.order[:: 4**n], side)
    out = torch.empty(width, width, values.shape[1])
    out[row >> n, column >> n] = values
    return out


@pytest.fixture(scope="module")
def of_image(image):
    """What the image network makes of the picture, by its settings."""

    @cache
    def features(pool, normalised):
        return Vgg16(pool=pool, precision="float32", normalised=normalised).features(image[None], LAYERS)

    return features


@pytest.mark.parametrize(
    ("kind", "pool", "normalised"),
    [
        ("levels", "average", False),
        ("levels", "average", True),
        ("levels", "max", False),
        ("traced_levels", "average", False),
    ],
)
def test_every_layer_equals_the_image_network_on_a_grid(request, kind, image, of_image, pool, normalised):
    levels = request.getfixturevalue(kind)
    ours = SurfaceVgg(levels, pool=pool, precision="float32", normalised=normalised)
    features = ours.features(image.view(-1, 3)[levels.order], LAYERS)
    expected = of_image(pool, normalised)
    for layer in LAYERS:
        inner = slice(MARGIN[int(layer[4])], -MARGIN[int(layer[4])])
        a = as_image(levels, features[layer], layer)[inner, inner]
        b = expected[layer][0, inner, inner]
        assert b.numel() and (a - b).abs().max() < 1e-4 * b.abs().max(), layer


@pytest.mark.parametrize("kind", ["small_levels", "small_traced_levels"])
def test_input_gradient_equals_the_image_networks(request, kind, small_image):
    """Of the centre of each layer, in float32."""
    levels = request.getfixturevalue(kind)
    ours, theirs = SurfaceVgg(levels, precision="float32"), Vgg16(precision="float32", normalised=False)
    generator = torch.Generator().manual_seed(1)
    for layer in ("relu1_1", "relu1_2", "relu2_2", "relu3_3", "relu4_3"):
        texels = small_image.view(-1, 3)[levels.order].clone().requires_grad_()
        picture = small_image[None].clone().requires_grad_()
        a = as_image(levels, ours.features(texels, [layer])[layer], layer)
        b = theirs.features(picture, [layer])[layer][0]
        centre = slice(len(b) // 2 - 1, len(b) // 2 + 1)
        upstream = torch.randn(2, 2, b.shape[2], generator=generator)
        (gradient,) = torch.autograd.grad((a[centre, centre] * upstream).sum(), texels)
        (expected,) = torch.autograd.grad((b[centre, centre] * upstream).sum(), picture)
        expected = expected.view(-1, 3)[levels.order]
        assert (gradient - expected).norm() < 1e-4 * expected.norm(), layer


@pytest.fixture(scope="module")
def irregular():
    """Levels with taps and groups at random: many readers of some elements, none of others."""
    rng = np.random.default_rng(0)
    levels, count = [], 700
    for _ in range(5):
        taps = rng.integers(0, count, (count, 9)).astype(np.int32)
        taps[:, 4] = np.arange(count)
        sizes = np.bincount(np.sort(rng.integers(0, count // 3, count)), minlength=count // 3)
        sizes = sizes[sizes > 0].astype(np.int32)
        levels.append(Level(taps, sizes))
        count = len(sizes)
    return levels


@pytest.mark.parametrize("chunk", [1 << 20, 9 * 64 * 16])
def test_convolution_against_autograd(irregular, chunk, monkeypatch):
    monkeypatch.setattr(room, "CHUNK", chunk)
    generator = torch.Generator().manual_seed(2)
    weight, bias = torch.randn(16, 8, 3, 3, generator=generator), torch.randn(16, generator=generator)
    taps = irregular[0].taps
    x = torch.randn(len(taps), 8, generator=generator, requires_grad=True)
    gathered = x[torch.from_numpy(taps).long()]
    expected = torch.relu(torch.einsum("nki,oik->no", gathered, weight.flatten(2)) + bias)
    conv = SurfaceConv(Kernel.of(weight, bias, torch.float32), Neighbourhood.of(taps))
    output = conv.forward(x.detach())
    assert torch.allclose(output, expected, atol=1e-4)
    upstream = torch.randn(output.shape, generator=generator)
    (expected_gradient,) = torch.autograd.grad(expected, x, upstream)
    assert torch.allclose(conv.backward(upstream.clone(), output), expected_gradient, atol=1e-3)


@pytest.mark.parametrize("kind", ["average", "max"])
def test_pooling_against_loops(irregular, kind):
    generator = torch.Generator().manual_seed(3)
    sizes = irregular[0].sizes
    x = torch.randn(int(sizes.sum()), 5, generator=generator, requires_grad=True)
    parts = x.split(sizes.tolist())
    expected = torch.stack([p.mean(0) if kind == "average" else p.amax(0) for p in parts])
    pool = SurfacePool(kind, sizes)
    output = pool.forward(x.detach())
    assert torch.allclose(output, expected, atol=1e-6)
    upstream = torch.randn(output.shape, generator=generator)
    (expected_gradient,) = torch.autograd.grad(expected, x, upstream)
    assert torch.allclose(pool.backward(upstream, x.detach()), expected_gradient, atol=1e-6)


@pytest.mark.parametrize("regions", [1, 7])
def test_gram_matrices_and_their_gradient(small_levels, small_image, regions):
    """Against those of the features, in float32; all layers together."""
    ours = SurfaceVgg(small_levels, precision="float32")
    names = ("relu1_1", "pool1", "relu2_2", "relu3_1")
    texels = small_image.view(-1, 3)[small_levels.order].clone().requires_grad_()
    parts = {name: None if regions == 1 else ours.regions(name, regions) for name in names}
    grams = ours.read(texels, {name: GramTap(ours.index_of(name), parts[name]) for name in names})
    features = ours.features(texels, names)
    total, expected = torch.zeros(()), torch.zeros(())
    for k, name in enumerate(names):
        groups = [features[name][i] for i in parts[name] or [slice(None)]]
        gram = torch.stack([f.T @ f / len(f) for f in groups])
        assert torch.allclose(grams[name], gram, rtol=1e-4, atol=1e-5)
        generator = torch.Generator().manual_seed(k)
        upstream = torch.randn(gram.shape, generator=generator)
        total, expected = total + (grams[name] * upstream).sum(), expected + (gram * upstream).sum()
    (a,) = torch.autograd.grad(total, texels)
    (b,) = torch.autograd.grad(expected, texels)
    assert (a - b).norm() < 1e-4 * b.norm()


def _grams(network, texels, layers):
    return network.read(texels, {name: GramTap(network.index_of(name)) for name in layers})


def test_finite_differences(levels, image):
    """Of the sum of all Gram matrices along a random direction."""
    ours = SurfaceVgg(levels, precision="float32")
    generator = torch.Generator().manual_seed(4)
    x = image.view(-1, 3)[levels.order].clone().requires_grad_()

    def value(texels):
        grams = _grams(ours, texels, ("relu2_1", "pool3"))
        return torch.stack([gram.double().sum() for gram in grams.values()]).sum()

    (gradient,) = torch.autograd.grad(value(x), x)
    direction = torch.randn(x.shape, generator=generator)
    step = 1e-3
    with torch.no_grad():
        measured = (value(x + step * direction) - value(x - step * direction)) / (2 * step)
    assert abs(measured - (gradient * direction).sum()) < 1e-2 * abs(measured)


def test_bfloat16_agrees():
    """On few texels: where a processor has no instructions for it, products take a hundred times as long."""
    levels = grid_levels(16)
    texels = random_image(16).view(-1, 3)[levels.order]
    results = []
    for precision in ("float32", "bfloat16"):
        x = texels.clone().requires_grad_()
        network = SurfaceVgg(levels, precision=precision)
        grams = _grams(network, x, ("relu1_2", "relu2_2", "relu3_3"))
        loss = torch.stack([gram.square().mean() for gram in grams.values()]).sum()
        results.append((grams, torch.autograd.grad(loss, x)[0]))
    (exact, gradient), (rounded, close) = results
    for name in exact:
        assert (exact[name] - rounded[name]).norm() < 1e-2 * exact[name].norm()
    assert torch.cosine_similarity(gradient.flatten(), close.flatten(), dim=0) > 0.999


def test_an_unknown_precision_is_refused(small_levels):
    with pytest.raises(ConfigError, match="unknown precision 'float16'"):
        SurfaceVgg(small_levels, precision="float16")


def test_random_weights_are_used_as_they_are(small_levels, small_image):
    """Features are those of the image network with the same weights, and not the trained ones."""
    weights, picture = random_weights(torch.Generator().manual_seed(0)), small_image[None]
    features = SurfaceVgg(small_levels, precision="float32", weights=weights).features(
        small_image.view(-1, 3)[small_levels.order], ["relu2_1"]
    )
    expected = Vgg16(precision="float32", weights=weights).features(picture, ["relu2_1"])["relu2_1"][0]
    inner = slice(MARGIN[2], -MARGIN[2])
    a, b = as_image(small_levels, features["relu2_1"], "relu2_1")[inner, inner], expected[inner, inner]
    assert (a - b).abs().max() < 1e-4 * b.abs().max()
    trained = Vgg16(precision="float32", normalised=False).features(picture, ["relu2_1"])["relu2_1"][0]
    assert (trained[inner, inner] - b).norm() > 0.5 * b.norm()


def test_random_weights_are_those_of_he():
    """Zero mean, variance 2 over the inputs of an output, no biases: signals neither fade nor grow."""
    for name, (weight, bias) in random_weights(torch.Generator().manual_seed(0)).items():
        assert not bias.any() and weight.shape == convolutions("average", False)[name][0].shape
        deviation = (2 / weight[0].numel()) ** 0.5
        assert abs(float(weight.std()) / deviation - 1) < 0.05 and abs(float(weight.mean())) < 0.1 * deviation


def test_wrong_input_is_refused(small_levels, small_image):
    ours = SurfaceVgg(small_levels)
    with pytest.raises(ConfigError, match="relu9_9"):
        ours.features(small_image.view(-1, 3), ["relu9_9"])
    with pytest.raises(ConfigError, match="shape"):
        ours.features(small_image, ["relu1_1"])
