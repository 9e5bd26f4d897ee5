"""The flow network: what it computes, and that the shipped weights are as good as they should be."""

import pytest
import torch

from mitex.errors import ImageError, WeightsError
from mitex.evaluation.motion import motion_errors
from mitex.features import weights
from mitex.features.flow import FlowNetwork, flow_network, network
from mitex.features.flow.network import match_costs
from tests.features.flow.synthetic import affine, pair, places, shift


@pytest.fixture(scope="module")
def shipped() -> FlowNetwork:
    return flow_network()


def errors(estimate: torch.Tensor, motion: torch.Tensor):
    weight = torch.zeros(1, *motion.shape[1:])
    weight[:, 16:-16, 16:-16] = 1
    return motion_errors(estimate, motion[None], weight)


@pytest.mark.parametrize("motion", [(0.7, 0.0), (0.0, -0.7), (1.2, 1.1), (-1.9, 0.4)])
def test_translations(shipped, motion):
    measured = errors(shipped(pair(shift(*motion))), shift(*motion))
    assert measured.end_point < 0.15 and measured.direction < 5
    assert measured.speed_ratio == pytest.approx(1, abs=0.1)


@pytest.mark.parametrize("matrix", [[[0.05, 0.0], [0.0, 0.05]], [[0.0, -0.05], [0.05, 0.0]]])
def test_zoom_and_rotation(shipped, matrix):
    measured = errors(shipped(pair(affine(matrix))), affine(matrix))
    assert measured.end_point < 0.15 and measured.speed_ratio == pytest.approx(1, abs=0.1)


def test_a_changing_look(shipped):
    motion, frames = shift(0.9, -0.6), pair(shift(0.9, -0.6)).clamp(0, 1)
    generator = torch.Generator().manual_seed(0)
    frames[:, 1] = 0.7 * frames[:, 1] ** 1.3 + 0.2
    frames += 0.02 * torch.randn(frames.shape, generator=generator)
    measured = errors(shipped(frames), motion)
    assert measured.direction < 8 and measured.speed_ratio == pytest.approx(1, abs=0.12)


def test_equal_frames_hardly_move(shipped):
    assert shipped(pair(shift(0.0, 0.0))).norm(dim=1).mean() < 0.05


def test_any_size(shipped):
    motion = torch.tensor([1.0, -0.5]).double()[:, None, None].expand(2, 45, 70)
    assert shipped(pair(motion)).shape == (1, 2, 45, 70)
    assert errors(shipped(pair(motion)), motion).end_point < 0.15


def test_it_is_frozen_and_its_gradient_that_of_finite_differences(shipped):
    frames = pair(shift(0.8, 0.5, side=32)).double().requires_grad_()
    double = flow_network().double()
    assert not any(parameter.requires_grad for parameter in double.parameters())
    weight = torch.randn(1, 2, 32, 32, generator=torch.Generator().manual_seed(0)).double()
    (gradient,) = torch.autograd.grad((double(frames) * weight).sum(), frames)
    direction = torch.randn(frames.shape, generator=torch.Generator().manual_seed(1)).double()
    ahead, behind = (double(frames.detach() + s * 1e-7 * direction) for s in (1, -1))
    expected = ((ahead - behind) * weight).sum() / 2e-7
    assert float((gradient * direction).sum()) == pytest.approx(float(expected), rel=1e-3)


def test_untrained_it_sees_no_motion_and_gives_one_estimate_a_pass():
    estimates = FlowNetwork().estimates(torch.rand(2, 2, 33, 40))
    assert len(estimates) == 5
    assert all(estimate.shape == (2, 2, 33, 40) and not estimate.any() for estimate in estimates)
    assert sum(parameter.numel() for parameter in FlowNetwork().parameters()) == 117_362


def test_costs_by_loops():
    frames = torch.rand(1, 2, 12, 14, generator=torch.Generator().manual_seed(0))
    (first, second), row, column = (
        frames[0],
        slice(2, 8),
        slice(4, 10),
    )  # around the place (2, 3) at half size
    costs = []
    for y in (-1, 0, 1):
        for x in (-1, 0, 1):
            shifted = second[2 + y : 8 + y, 4 + x : 10 + x]
            costs.append((shifted - first[row, column]).square().mean())
    expected = torch.stack(costs) / (torch.stack(costs).mean() + 0.01) - 1
    assert match_costs(frames).shape == (1, 9, 6, 7)
    assert torch.allclose(match_costs(frames)[0, :, 2, 3], expected, atol=1e-5)


def test_costs_are_lowest_at_the_true_shift():
    x, y = places(32, 32)
    frames = pair(torch.stack([torch.ones_like(x), -torch.ones_like(y)]))
    assert (match_costs(frames)[0, :, 2:-2, 2:-2].argmin(0) == 2).all()  # a row up, a column to the right


@pytest.mark.parametrize(
    ("shape", "message"), [((1, 3, 32, 32), "shape"), ((2, 32, 32), "shape"), ((1, 2, 15, 32), "too small")]
)
def test_frames_that_do_not_fit(shape, message):
    with pytest.raises(ImageError, match=message):
        FlowNetwork()(torch.zeros(shape))


@pytest.fixture
def folder(monkeypatch, tmp_path):
    """An empty folder of weights, with nothing loaded before or after."""
    monkeypatch.setattr(weights, "FOLDER", tmp_path)
    network._load.cache_clear()
    yield tmp_path
    network._load.cache_clear()


def test_no_weights(folder):
    with pytest.raises(WeightsError, match="not at"):
        flow_network()


@pytest.mark.parametrize("damage", ["bit", "cut", "shape"])
def test_other_weights(folder, damage):
    from safetensors.torch import load_file, save_file

    original = weights.Path(weights.__file__).parents[1] / "data" / "weights" / weights.FLOW_FILE
    content, file = bytearray(original.read_bytes()), folder / weights.FLOW_FILE
    content[len(content) // 2] ^= 1
    file.write_bytes(content if damage == "bit" else content[:1000])
    if damage == "shape":
        save_file(load_file(original) | {"head.bias": torch.zeros(3)}, file)
    with pytest.raises(WeightsError, match="not the expected file"):
        flow_network()


def test_the_file_is_small_and_tells_how_it_was_made():
    from safetensors import safe_open

    path = weights.shipped(weights.FLOW_FILE)
    assert path.stat().st_size < 1_000_000
    with safe_open(path, "pt") as file:
        about = file.metadata()
    assert int(about["training_steps"]) > 1000
    assert float(about["end_point_error_the_same"]) < 0.3 and float(about["end_point_error_changing"]) < 0.3
