"""The field's networks and hash grids against torch, and how fields are marched."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
import torch

from mitex.bridge import call
from mitex.methods.nerf import field as networks
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field import Decoder, Encoding, embedded, weight_bound, weight_shapes
from mitex.methods.nerf.tensors import channels, rows, tensor
from mitex.runtime import init

mi = init()
import drjit as dr  # noqa: E402

SMALL = NerfConfig(table=10, coarsest=8, finest=16)
POINTS = 300


def weights(seed: int = 0) -> list[torch.Tensor]:
    drawn = torch.Generator().manual_seed(seed)
    return [
        torch.empty(s).uniform_(-weight_bound(s), weight_bound(s), generator=drawn) for s in weight_shapes()
    ]


def inputs(seed: int = 0) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    drawn = torch.Generator().manual_seed(seed)
    f, phase = torch.randn(POINTS, 16, generator=drawn), torch.randn(POINTS, 8, generator=drawn)
    return f, phase, 0.1 * torch.randn(POINTS, generator=drawn)


def oracle(f, phase, distance, matrices):
    """The networks in plain torch: density, k_d, k_s, g, theta, phi as (N, 8)."""
    waves = [distance[:, None]]
    for octave in range(12):
        waves += [torch.sin(distance * 2**octave)[:, None], torch.cos(distance * 2**octave)[:, None]]
    fine = torch.cat(waves, 1)
    given = iter(matrices)

    def run(count, x):
        for k in range(count):
            x = x @ next(given).T
            x = torch.relu(x) if k < count - 1 else x
        return x

    density = run(2, torch.cat([f, fine], 1))
    reflection = run(3, density[:, 1:])
    theta = run(3, torch.cat([f, fine[:, :12]], 1))
    phi = run(3, torch.cat([phase, fine[:, :12]], 1))
    gloss = torch.nn.functional.softplus(reflection[:, 4:]) + 1
    return torch.cat([density[:, :1].exp(), reflection[:, :4].sigmoid(), gloss, theta, phi], 1)


def decoded(f, phase, distance, *matrices, packed=False):
    def run(f, phase, distance, *matrices):
        split = [_columns(x) for x in (f, phase)]
        found = Decoder(matrices, packed)(*split, distance.array)
        values = [found.density, *found.diffuse, found.specular, found.glossiness, found.theta, found.phi]
        return tensor(mi.ArrayXf(*values))

    return call(run, f, phase, distance, *matrices)


def _columns(x):
    index = dr.arange(mi.UInt32, x.shape[0]) * x.shape[1]
    return [dr.gather(mi.Float, x.array, index + k) for k in range(x.shape[1])]


@pytest.mark.parametrize("packed", [False, True])
def test_the_networks_agree_with_torch(packed):
    given = (*inputs(), *weights())
    expected = oracle(*given[:3], given[3:])
    np.testing.assert_allclose(decoded(*given, packed=packed), expected, rtol=2e-4, atol=2e-5)


def test_gradients_of_the_networks_agree_with_torch():
    ours, theirs = ([x.clone().requires_grad_() for x in (*inputs(), *weights())] for _ in range(2))
    share = torch.randn(POINTS, 8, generator=torch.Generator().manual_seed(3))
    (decoded(*ours) * share).sum().backward()
    (oracle(*theirs[:3], theirs[3:]) * share).sum().backward()
    for a, b in zip(ours, theirs, strict=True):
        np.testing.assert_allclose(a.grad, b.grad, rtol=1e-3, atol=1e-3 * float(b.grad.abs().max()))


def looked_up(config: NerfConfig, table: np.ndarray, points: np.ndarray) -> np.ndarray:
    """f by loops over levels and corners, with the hash of Mueller et al. 2022."""
    encoding = Encoding(config)
    ratio = (config.finest / config.coarsest) ** (1 / 7)
    columns = []
    for level, part in enumerate(encoding.levels(0)):
        entries = table[part].reshape(-1, 2)
        scale = config.coarsest * ratio**level - 1
        side = int(np.ceil(scale)) + 1
        place = (points.astype(np.float64) * 0.5 + 0.5) * scale
        low = np.floor(place).astype(np.int64)
        share = place - low
        total = np.zeros((len(points), 2))
        for corner in itertools.product((0, 1), repeat=3):
            at = low + corner
            weight = np.where(corner, share, 1 - share).prod(1)
            if side**3 > len(entries):
                index = np.bitwise_xor.reduce((at * [1, 2654435761, 805459861]) & 0xFFFFFFFF, axis=1)
            else:
                index = at @ [1, side, side**2]
            total += weight[:, None] * entries[index % len(entries)]
        columns.append(total)
    return np.concatenate(columns, 1)


def stacked(found) -> np.ndarray:
    return np.stack([np.array(v) for v in found], 1)


def test_features_agree_with_a_hash_grid_by_loops():
    rng = np.random.default_rng(0)
    encoding = Encoding(SMALL)
    table = rng.normal(size=encoding.sizes[0]).astype(np.float32)
    points = rng.uniform(-0.99, 0.99, (200, 3)).astype(np.float32)
    found = encoding(0, channels(mi.Point3f, points), mi.Float(table))
    np.testing.assert_allclose(stacked(found), looked_up(SMALL, table, points), atol=2e-4)


def test_points_beyond_the_cube_get_features_of_its_border():
    encoding = Encoding(SMALL)
    table = mi.Float(np.random.default_rng(0).normal(size=encoding.sizes[0]).astype(np.float32))
    far, near = (channels(mi.Point3f, np.array([[x, 0.2, 0.3]])) for x in (3.0, 1.0))
    np.testing.assert_array_equal(stacked(encoding(0, far, table)), stacked(encoding(0, near, table)))


def test_the_embedding_is_the_distance_and_its_waves():
    values = [np.array(v) for v in embedded(mi.Float(0.3, -0.1))]
    assert len(values) == networks.FINE == 25
    np.testing.assert_allclose(values[0], [0.3, -0.1], rtol=1e-6)
    np.testing.assert_allclose(values[23], np.sin(2**11 * np.float32([0.3, -0.1])), atol=2e-4)


def test_the_normal_of_equation_4():
    found = networks.Reflection(None, None, None, None, mi.Float(0.3), mi.Float(1.1))
    axes = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    normal = found.normal(*(mi.Vector3f(*row.tolist()) for row in axes))
    local = [np.sin(0.3) * np.cos(1.1), np.sin(0.3) * np.sin(1.1), np.cos(0.3)]
    np.testing.assert_allclose(rows(normal)[0], local @ axes, atol=1e-6)


def test_densities_stay_finite():
    found = networks.Reflection(mi.Float(1e4), None, None, None, None, None)
    assert np.isfinite(np.array(found.density)).all()
