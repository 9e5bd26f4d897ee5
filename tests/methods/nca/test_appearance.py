"""The appearance loss against its parts, put together by hand."""

import numpy as np
import pytest
import torch

from benchmarks import naive
from mitex.exemplar import Exemplar
from mitex.features import Vgg16
from mitex.features.vgg import MEAN_ACTIVATION
from mitex.methods.nca.appearance import Appearance, _places
from mitex.methods.nca.targets import Targets
from mitex.triples import channel_triples, map_layout, triple_images
from tests.losses import authors
from tests.methods.nca.tiny import config

MAPS = ["albedo", "height", "normal", "roughness"]


@pytest.fixture(scope="module")
def network():
    return Vgg16(precision="float32")


@pytest.fixture(scope="module")
def exemplar():
    maps = Exemplar.load("scales").resized(32).maps
    return Exemplar({name: maps[name] for name in MAPS})


@pytest.fixture(scope="module")
def albedo(exemplar):
    return Exemplar({"albedo": exemplar.maps["albedo"]})


def _appearance(exemplar, network, settings):
    layout = map_layout(sorted(exemplar.maps))
    pictures = channel_triples(layout, settings.blend, 0)
    return Appearance(settings, Targets(exemplar, pictures, layout, network, settings.layers), network)


def _pictures(appearance, exemplar):
    """What the features of the targets are of, (P, H, W, 3)."""
    layout = map_layout(sorted(exemplar.maps))
    return torch.from_numpy(triple_images(exemplar, appearance.targets.pictures, layout))


def _views(count, channels, seed=0):
    return torch.rand(count, 32, 32, channels, generator=torch.Generator().manual_seed(seed))


def _expected(images, pictures, settings):
    """Equation 6 with all positions of both sides, so that sampling draws nothing."""
    tensors = naive.vgg_weights()
    scale = MEAN_ACTIVATION[settings.pooling]
    total = torch.zeros(())
    ours, theirs = (naive.vgg(x, tensors, settings.pooling, scale) for x in (images, pictures))
    for layer in settings.layers:
        a, b = ours[layer].flatten(1, 2), theirs[layer].flatten(1, 2)
        moments = settings.moment_weight * naive.moment_distance(a, b)
        total = total + (naive.relaxed_transport(a, b) + moments).mean()
    a, b = (x.flatten(1, 2).numpy() for x in (images, pictures))
    colours = np.mean([authors.colour_cost(x, y) for x, y in zip(a, b, strict=True)])
    if settings.colour_histogram:
        colours += np.mean(np.abs(np.sort(a, 1) - np.sort(b, 1)) / authors.SPREAD)
    return settings.appearance_weight * (total + settings.colour_weight * colours)


@pytest.mark.parametrize("preset", ["patch", "paper"])
def test_loss_of_an_albedo(albedo, preset):
    settings = config("samples=4096", "views=patch", "colour_weight=3", preset=preset)
    appearance = _appearance(albedo, Vgg16(settings.pooling, precision="float32"), settings)
    views = _views(3, 3)
    loss = appearance(views, torch.Generator().manual_seed(0))
    expected = _expected(views, _pictures(appearance, albedo).expand(3, -1, -1, -1), settings)
    assert loss.item() == pytest.approx(expected.item(), rel=1e-4)


def test_every_view_shows_every_map_in_the_paper(exemplar, network):
    settings = config("samples=4096", preset="paper")
    appearance = _appearance(exemplar, network, settings)
    views = _views(2, 8)
    # Columns of the views: albedo 0-2, height 3, normal 4-6, roughness 7.
    columns = ([0, 1, 2], [3, 3, 3], [4, 5, 6], [7, 7, 7])
    images = torch.cat([views[..., c] for c in columns])
    pictures = _pictures(appearance, exemplar).repeat_interleave(2, 0)
    loss = appearance(views, torch.Generator().manual_seed(0))
    assert loss.item() == pytest.approx(_expected(images, pictures, settings).item(), rel=1e-4)


def test_the_exemplar_itself_costs_nothing(exemplar, network):
    """But for the clamp of colour distances."""
    settings = config("samples=4096", "blend=false", "view_count=1")
    appearance = _appearance(exemplar, network, settings)
    maps = [torch.from_numpy(exemplar.maps[name]) for name in MAPS]
    loss = appearance(torch.cat(maps, 2)[None], torch.Generator().manual_seed(0))
    assert loss.item() < 1e-3


def test_blended_views_share_the_kinds(exemplar, network):
    appearance = _appearance(exemplar, network, config("blend=true"))
    generator = torch.Generator().manual_seed(0)
    kinds = [p.kind for p in appearance.targets.pictures]
    mixes = set()
    for _ in range(10):
        view, which = appearance._assignment(8, generator)
        assert view.tolist() == list(range(8))
        view_kinds = [kinds[i] for i in which.tolist()]
        assert sorted(view_kinds) == sorted(2 * ["albedo", "grey", "mix", "normal"])
        mixes |= {i for i in which.tolist() if kinds[i] == "mix"}
    assert len(mixes) > 6


def test_a_few_blended_views_take_turns(exemplar, network):
    """Fewer views than kinds: no kind is left out for ever."""
    appearance = _appearance(exemplar, network, config("blend=true"))
    generator = torch.Generator().manual_seed(0)
    kinds = [p.kind for p in appearance.targets.pictures]
    view_kinds = {kinds[i] for _ in range(40) for i in appearance._assignment(1, generator)[1].tolist()}
    assert view_kinds == {"albedo", "grey", "mix", "normal"}


@pytest.mark.parametrize("blend", ["true", "false"])
def test_gradient_reaches_what_is_shown(exemplar, network, blend):
    appearance = _appearance(exemplar, network, config(f"blend={blend}"))
    views = _views(4, 8).requires_grad_()
    appearance(views, torch.Generator().manual_seed(0)).backward()
    assert views.grad is not None and views.grad.isfinite().all()
    assert (views.grad.abs().amax((0, 1, 2)) > 0).all()


def test_randomness_is_the_generators(exemplar, network):
    appearance = _appearance(exemplar, network, config("samples=64"))
    values = [appearance(_views(4, 8), torch.Generator().manual_seed(seed)).item() for seed in (3, 3, 4)]
    assert values[0] == values[1] != values[2]


def test_a_sample_estimates_the_whole(exemplar, network):
    """From above: of fewer vectors, the nearest is farther."""
    views = _views(4, 8)
    whole, half, quarter = (
        _appearance(exemplar, network, config(f"samples={n}", "blend=false"))(
            views, torch.Generator().manual_seed(0)
        ).item()
        for n in (4096, 512, 256)
    )
    assert 1.01 * whole < half < 1.2 * whole
    assert half < quarter < 1.5 * whole


def test_places_do_not_repeat():
    places = _places(3, 50, 40, torch.Generator().manual_seed(0))
    assert places.shape == (3, 40)
    for row in places.tolist():
        assert len(set(row)) == 40 and min(row) >= 0 and max(row) < 50
    assert not torch.equal(places[0], places[1])


def test_black_has_a_direction(albedo, network):
    """A black background, more than half of a full view, is a colour like any other: with all else switched
    off it costs what the authors compute, and the gradient leads towards the exemplar's colours."""
    settings = config(
        "samples=4096", "moment_weight=0", "layers=relu1_1", "colour_weight=1e4", preset="paper"
    )
    appearance = _appearance(albedo, network, settings)
    black = torch.zeros(1, 32, 32, 3, requires_grad=True)
    loss = appearance(black, torch.Generator().manual_seed(0))
    target = albedo.maps["albedo"].reshape(-1, 3)
    expected = 2e4 * authors.colour_cost(np.zeros((1024, 3)), target)
    assert loss.item() == pytest.approx(expected, rel=1e-3)
    (gradient,) = torch.autograd.grad(loss, black)
    after = appearance(
        black.detach() - 1e-2 * gradient / gradient.abs().max(), torch.Generator().manual_seed(0)
    )
    assert gradient.isfinite().all()
    assert after < loss
