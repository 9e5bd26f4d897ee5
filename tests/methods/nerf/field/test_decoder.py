"""The field's networks and hash grids against torch, and how fields are marched."""

from __future__ import annotations

from dataclasses import fields
from typing import Any

import numpy as np
import pytest
import torch

from benchmarks import torch_field
from mitex.bridge import call
from mitex.methods.nerf.config import PRESETS, NerfConfig
from mitex.methods.nerf.field import mlp
from mitex.methods.nerf.field.decoder import Decoder, Reflection, frequency_encoding
from mitex.methods.nerf.field.mlp import weight_bound
from mitex.methods.nerf.field.networks import FINE, weight_shapes
from mitex.methods.nerf.field.tensors import rows, tensor
from mitex.runtime import init
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload

init()

SMALL = NerfConfig(table=10, coarsest=8, finest=16)
POINTS = 300


def weights(preset: str, seed: int = 0) -> list[torch.Tensor]:
    generator = torch.Generator().manual_seed(seed)
    return [
        torch.empty(s).uniform_(-weight_bound(s), weight_bound(s), generator=generator)
        for s in weight_shapes(PRESETS[preset])
    ]


def inputs(seed: int = 0) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor]:
    generator = torch.Generator().manual_seed(seed)
    f, phase = torch.randn(POINTS, 16, generator=generator), torch.randn(POINTS, 8, generator=generator)
    return f, phase, 0.1 * torch.randn(POINTS, generator=generator)


def decoded(f, phase, distance, *matrices, packed=False, low_precision=False):
    def run(f, phase, distance, *matrices):
        reflection = Decoder(matrices, packed, low_precision)(_columns(f), _columns(phase), distance.array)
        return tensor(mi.ArrayXf(*torch_field.outputs(reflection)))

    return call(run, f, phase, distance, *matrices)


def _columns(x):
    index = dr.arange(mi.UInt32, x.shape[0]) * x.shape[1]
    return [dr.gather(mi.Float, x.array, index + k) for k in range(x.shape[1])]


def reflection_with(**values: Any) -> Reflection:
    """A reflection of which no more is known."""
    unknown: dict[str, Any] = dict.fromkeys(f.name for f in fields(Reflection))
    return Reflection(**unknown | values)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("packed", [False, True])
def test_the_networks_agree_with_torch(packed, preset):
    arguments = (*inputs(), *weights(preset))
    expected = torch_field.decoded(*inputs(), weights(preset))
    np.testing.assert_allclose(decoded(*arguments, packed=packed), expected, rtol=2e-4, atol=2e-5)


@pytest.mark.parametrize("preset", PRESETS)
@pytest.mark.parametrize("chunk", [mlp.CHUNK, 70])
@pytest.mark.parametrize("moving", [True, False])
def test_gradients_of_the_networks_agree_with_torch(moving, preset, chunk, monkeypatch):
    monkeypatch.setattr(mlp, "CHUNK", chunk)
    ours, theirs = ([x.clone().requires_grad_() for x in (*inputs(), *weights(preset))] for _ in range(2))
    ours[2].requires_grad_(moving)
    share = torch.randn(POINTS, 9, generator=torch.Generator().manual_seed(3))
    (decoded(*ours) * share).sum().backward()
    f, phase, distance, *matrices = theirs
    (torch_field.decoded(f, phase, distance, matrices) * share).sum().backward()
    for k, (a, b) in enumerate(zip(ours, theirs, strict=True)):
        if k == 2 and not moving:
            continue
        assert a.grad is not None and b.grad is not None
        largest = float(b.grad.abs().max())
        np.testing.assert_allclose(a.grad.numpy(), b.grad.numpy(), rtol=1e-3, atol=1e-3 * largest)


def gradient(x: torch.Tensor) -> torch.Tensor:
    assert x.grad is not None
    return x.grad


@pytest.mark.parametrize("chunk", [mlp.LONG, 64])
def test_gradients_of_low_precision_are_near_and_values_the_same(chunk, monkeypatch):
    monkeypatch.setattr(mlp, "LONG", chunk)
    monkeypatch.setattr(mlp, "GRAIN", 32)
    results = []
    for low_precision in (False, True):
        arguments = [x.clone().requires_grad_() for x in (*inputs(), *weights("fast"))]
        arguments[2].requires_grad_(False)
        result = decoded(*arguments, low_precision=low_precision)
        result.square().sum().backward()
        results.append((result.detach().numpy(), [gradient(x) for x in arguments if x.requires_grad]))
    (value, exact), (same, near) = results
    np.testing.assert_allclose(value, same, rtol=1e-5, atol=1e-6)
    for a, b in zip(exact, near, strict=True):
        assert 0 < (a - b).norm() < 0.01 * a.norm()


def test_gradients_of_points_that_move_are_exact():
    def of_distance(low_precision):
        arguments = [x.clone().requires_grad_() for x in (*inputs(), *weights("fast"))]
        decoded(*arguments, low_precision=low_precision).square().sum().backward()
        return gradient(arguments[2])

    exact = of_distance(False)
    np.testing.assert_allclose(of_distance(True), exact, rtol=1e-4, atol=1e-5 * float(exact.abs().max()))


def test_the_embedding_is_the_distance_and_its_waves():
    values = [np.array(v) for v in frequency_encoding(mi.Float(0.3, -0.1))]
    assert len(values) == FINE == 25
    np.testing.assert_allclose(values[0], [0.3, -0.1], rtol=1e-6)
    np.testing.assert_allclose(values[23], np.sin(2**11 * np.array([0.3, -0.1], np.float32)), atol=2e-4)


def test_the_normal_of_equation_4():
    reflection = reflection_with(theta=mi.Float(0.3), phi=mi.Float(1.1))
    axes = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    normal = reflection.normal(*(mi.Vector3f(*row.tolist()) for row in axes))
    local = [np.sin(0.3) * np.cos(1.1), np.sin(0.3) * np.sin(1.1), np.cos(0.3)]
    np.testing.assert_allclose(rows(normal)[0], local @ axes, atol=1e-6)


def test_surfaces_mirror_more_at_grazing_angles():
    reflection = reflection_with(specular=mi.Float(0.04), grazing=mi.Float(0.6))
    np.testing.assert_allclose(
        np.array(reflection.specular_at(mi.Float([1.0, 0.5, 0.0]))), [0.04, 0.0575, 0.6]
    )


def test_as_published_they_mirror_as_much_from_all_sides():
    f, phase, distance = inputs()
    decoder = Decoder([upload(mi.TensorXf, w.numpy()) for w in weights("paper")])
    f, phase = (_columns(upload(mi.TensorXf, x.numpy())) for x in (f, phase))
    reflection = decoder(f, phase, upload(mi.Float, distance.numpy()))
    for cosine in (0.0, 0.3, 1.0):
        np.testing.assert_array_equal(np.array(reflection.specular_at(cosine)), np.array(reflection.specular))


def test_densities_stay_finite():
    reflection = reflection_with(exponent=mi.Float(1e4))
    assert np.isfinite(np.array(reflection.density)).all()
