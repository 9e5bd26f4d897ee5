"""Coordinates of the optimizer."""

import numpy as np
import torch

from mitex.exemplar import Exemplar
from mitex.methods.surface.colour_space import MIN_SPREAD, ColourSpace
from mitex.triples import map_layout


def exemplar():
    """Grey with a little noise in blue, and a height that follows it."""
    rng = np.random.default_rng(0)
    grey = rng.random((40, 50, 1)).astype(np.float32)
    albedo = np.concatenate([grey, grey, 0.9 * grey + 0.1 * rng.random(grey.shape)], 2).astype(np.float32)
    return Exemplar({"albedo": albedo, "height": 1 - grey})


def test_the_exemplar_is_white_but_for_the_floor():
    picture = exemplar()
    layout = map_layout(list(picture.maps))
    space = ColourSpace.of(picture, layout)
    pixels = torch.from_numpy(np.concatenate([picture.maps[name] for name in layout], 2)).view(-1, 4)
    coordinates = space.coordinates(pixels)
    covariance = torch.cov(coordinates.T)
    assert coordinates.mean(0).abs().max() < 1e-5
    assert (covariance - covariance.diag().diag()).abs().max() < 1e-4
    assert covariance.diag().max() <= 1 + 1e-4 and abs(covariance[3, 3] - 1) < 1e-4
    lengths = space.basis.norm(dim=1)
    assert lengths.min() >= MIN_SPREAD * lengths.max() * (1 - 1e-5)


def test_round_trips():
    picture = exemplar()
    x = torch.rand(7, 4, generator=torch.Generator().manual_seed(0))
    known = ColourSpace.of(picture, map_layout(list(picture.maps)))
    for space in (known, ColourSpace.plain(4), ColourSpace.around_grey(4)):
        assert torch.allclose(space.values(space.coordinates(x)), x, atol=1e-5)
    assert torch.equal(ColourSpace.plain(4).values(x), x)
    assert torch.equal(ColourSpace.around_grey(4).values(torch.zeros(2, 4)), torch.full((2, 4), 0.5))


def test_one_constant_map():
    space = ColourSpace.of(Exemplar({"height": np.full((8, 8, 1), 0.5, np.float32)}), {"height": (0,)})
    assert torch.isfinite(space.coordinates(torch.rand(3, 1))).all()
