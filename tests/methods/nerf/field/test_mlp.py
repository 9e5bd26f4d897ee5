"""Networks inside Dr.Jit against autograd."""

from __future__ import annotations

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.methods.nerf.field import mlp
from mitex.runtime import init, threads
from mitex.runtime.jit import dr, mi
from mitex.runtime.upload import upload
from tests.state import in_thread

init()

WIDTHS, POINTS = (5, 8, 7, 3), 50


@pytest.fixture
def arguments() -> list[torch.Tensor]:
    """Inputs, then the matrices."""
    generator = torch.Generator().manual_seed(0)
    shapes = [(WIDTHS[0], POINTS), *((o, i) for i, o in zip(WIDTHS[:-1], WIDTHS[1:], strict=True))]
    return [torch.randn(shape, generator=generator, requires_grad=True) for shape in shapes]


@pytest.mark.parametrize(("chunk", "cores"), [(mlp.CHUNK, 2), (16, 1), (7, 3)])
@pytest.mark.parametrize("learning", [True, False])
def test_values_and_gradients_are_those_of_autograd(arguments, learning, chunk, cores, monkeypatch):
    monkeypatch.setattr(mlp, "CHUNK", chunk)
    threads(cores)
    values, *weights = arguments
    x = values
    for weight in weights[:-1]:
        x = torch.relu(weight @ x)
    expected = weights[-1] @ x
    expected.square().sum().backward()

    ours, *matrices = (upload(mi.TensorXf, value.detach().numpy()) for value in arguments)
    dr.enable_grad(ours, *(matrices if learning else ()))
    outputs = mlp.evaluate(matrices, ours)
    dr.backward(dr.sum(outputs.array * outputs.array))
    np.testing.assert_allclose(np.array(outputs), expected.detach(), rtol=1e-4, atol=1e-4)
    _close(dr.grad(ours), values.grad)
    for matrix, weight in zip(matrices, weights, strict=True):
        _close(dr.grad(matrix), weight.grad if learning else torch.zeros_like(weight))


def test_networks_are_packed_for_processors_alone(arguments, monkeypatch):
    """On a graphics card Dr.Jit packs half precision only, and says so without a word of variants."""
    weights = [upload(mi.TensorXf, value.detach().numpy()) for value in arguments[1:]]
    mlp.packed_networks(weights)
    monkeypatch.setattr(dr, "backend_v", lambda _: dr.JitBackend.CUDA)
    with pytest.raises(ConfigError, match="a field of networks: it does not work .* use an llvm one"):
        mlp.packed_networks(weights)


def _close(actual, expected):
    np.testing.assert_allclose(np.array(actual), expected, rtol=1e-4, atol=1e-4 * float(expected.abs().max()))


def test_new_threads_of_the_program_get_as_many_of_torch_s_threads_as_before():
    """The pool's own use one each."""
    before = in_thread(torch.get_num_threads)
    own = mlp.on_threads(64, lambda parts: [torch.get_num_threads() for _ in parts])
    assert {count for counts in own for count in counts} == {1}
    assert in_thread(torch.get_num_threads) == before
