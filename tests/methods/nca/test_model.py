"""The cell rule against plain Python, its backward pass against autograd and finite differences."""

import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st

from benchmarks.naive import MessagePassing
from mitex.errors import ConfigError
from mitex.mesh import grid, icosphere, torus
from mitex.methods.nca import MeshNCA
from mitex.methods.nca.perception import perception
from tests.mesh.examples import meshes
from tests.methods.nca import brute_force
from tests.methods.nca.brute_force import patchwork


def _model(channels=4, hidden=6, condition=0, degree=1, seed=0, gain=1.2):
    model = MeshNCA(channels, hidden, condition, degree)
    generator = torch.Generator().manual_seed(seed)
    model.initialise(generator, gain)
    with torch.no_grad():
        model.fc2.bias.normal_(std=0.1, generator=generator)
    return model


@pytest.fixture
def generator():
    return torch.Generator().manual_seed(21)


@pytest.fixture(scope="module")
def mesh():
    return patchwork()


def _state(mesh, generator, channels=4, batch=2):
    return torch.rand(batch, len(mesh.vertices), channels, generator=generator) - 0.5


def _mask(shape, generator):
    return torch.rand(shape, generator=generator) < 0.5


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("kind", ["no mask", "mask (V,)", "mask (B, V)"])
def test_step_is_the_loops(mesh, generator, degree, kind):
    model = _model(degree=degree)
    state = _state(mesh, generator)
    count = len(mesh.vertices)
    mask = {"no mask": None, "mask (V,)": (count,), "mask (B, V)": (2, count)}[kind]
    mask = None if mask is None else _mask(mask, generator)
    result = model.step(state, mesh, mask)
    for k in range(2):
        own = None if mask is None else mask.expand(2, count)[k]
        assert (result[k] - brute_force.step(model, mesh, state[k], own)).abs().max() < 1e-5


@settings(max_examples=20, deadline=None)
@given(meshes(), st.sampled_from([0, 1, 2]), st.integers(0, 99))
def test_step_on_any_mesh(mesh, degree, seed):
    generator = torch.Generator().manual_seed(seed)
    model = _model(degree=degree, seed=seed)
    state, mask = _state(mesh, generator, batch=1), _mask(len(mesh.vertices), generator)
    expected = brute_force.step(model, mesh, state[0], mask)
    assert (model.step(state, mesh, mask)[0] - expected).abs().max() < 1e-5


def test_full_size_step_is_the_loops(mesh, generator):
    """16 channels, 128 hidden units, 20 steps: errors do not build up."""
    model = _model(16, 128, gain=0.3)
    state = torch.zeros(1, len(mesh.vertices), 16)
    naive, slow = MessagePassing.of(mesh, dtype=torch.float64), state.double()
    reference = _doubled(model)
    for k in range(20):
        mask = _mask(len(mesh.vertices), generator)
        if k < 2:
            expected = brute_force.step(model, mesh, slow[0], mask)
            slow = naive.step(reference, slow, mask)
            assert (slow[0] - expected).abs().max() < 1e-9
        else:
            slow = naive.step(reference, slow, mask)
        state = model.step(state, mesh, mask)
    assert state.abs().max() > 0.01
    assert (state - slow).abs().max() < 1e-5


def _doubled(model):
    twin = MeshNCA(model.channels, model.hidden, model.condition, model.degree)
    twin.load_state_dict(model.state_dict())
    return twin.double()


@pytest.mark.parametrize("shape", ["(V, d)", "(B, V, d)"])
def test_condition_is_appended_last(mesh, generator, shape):
    model = _model(condition=3)
    state = _state(mesh, generator)
    size = (len(mesh.vertices), 3) if shape == "(V, d)" else (2, len(mesh.vertices), 3)
    condition = torch.rand(size, generator=generator)
    result = model.step(state, mesh, None, condition)
    for k in range(2):
        own = condition.expand(2, -1, -1)[k]
        assert (result[k] - brute_force.step(model, mesh, state[k], condition=own)).abs().max() < 1e-5


def test_orientation_comes_with_the_perception(mesh, generator):
    model = _model()
    state = _state(mesh, generator, batch=1)
    result = model.step(state, perception(mesh, 1, 0.8))
    expected = brute_force.step(model, mesh, state[0], angles=[0.8] * len(mesh.vertices))
    assert (result[0] - expected).abs().max() < 1e-5


@pytest.mark.parametrize(
    ("options", "count"),
    [
        ({}, 12_432),  # the paper: "approximately 12k"
        ({"channels": 32, "condition": 3}, 25_120),
        ({"condition": 3}, 12_816),
        ({"degree": 0}, 6_288),
        ({"degree": 2}, 22_672),
    ],
)
def test_number_of_parameters(options, count):
    assert sum(p.numel() for p in MeshNCA(**options).parameters()) == count


@pytest.mark.parametrize(("block", "expected"), [(0, 101.0), (1, -1.0), (2, 0.0), (3, 100.0), (4, 0.5)])
def test_first_layer_has_the_layout_of_the_authors(block, expected):
    """Blocks of channels: Laplacian, y, z, x, state. One weight at a time shows which number it reads.

    The vertex at the centre of the 2 x 2 grid has neighbours left, right, up, down and on a diagonal.
    """
    mesh = grid(2, 2)
    centre = next(i for i, p in enumerate(mesh.vertices) if not p.any())
    state = torch.zeros(1, 9, 2)
    state[0, :, 1] = 0.5  # the second channel; others see the first
    points = torch.tensor(mesh.vertices)
    state[0, torch.all(points == torch.tensor([1.0, 0, 0]), 1), 1] += 100.0
    state[0, torch.all(points == torch.tensor([0.0, -1, 0]), 1), 1] += 1.0
    model = MeshNCA(channels=2, hidden=1)
    for p in model.parameters():
        torch.nn.init.zeros_(p)
    with torch.no_grad():
        model.fc1.weight[0, 2 * block + 1] = 1.0
        model.fc1.bias.fill_(1000.0)  # keeps the unit open
        model.fc2.weight[0, 0] = 1.0
    change = model.step(state, mesh)[0, centre] - state[0, centre]
    assert change.tolist() == pytest.approx([1000 + expected, 0], abs=1e-3)


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("masked", [False, True])
def test_gradients_are_those_of_message_passing(mesh, generator, degree, masked):
    """Of state, condition and all parameters, through four steps and a batch of two."""
    model = _model(5, 7, condition=2, degree=degree)
    twin = _doubled(model)
    naive = MessagePassing.of(mesh, degree, torch.float64)
    state = _state(mesh, generator, 5).requires_grad_()
    condition = torch.rand(len(mesh.vertices), 2, generator=generator).requires_grad_()
    state64, condition64 = (x.detach().double().requires_grad_() for x in (state, condition))
    fast, slow = state, state64
    for k in range(4):
        shape = (2, len(mesh.vertices)) if k % 2 else (len(mesh.vertices),)
        mask = _mask(shape, generator) if masked else None
        fast = model.step(fast, mesh, mask, condition)
        slow = naive.step(twin, slow, mask, condition64)
    upstream = torch.rand(fast.shape, generator=generator)
    ours = torch.autograd.grad(fast, [state, condition, *model.parameters()], upstream)
    theirs = torch.autograd.grad(slow, [state64, condition64, *twin.parameters()], upstream.double())
    for one, other in zip(ours, theirs, strict=True):
        assert one.shape == other.shape
        assert (one - other).norm() < 1e-4 * other.norm()


def test_gradients_are_finite_differences(generator):
    """Directional derivatives of a smooth function of two steps, by central differences."""
    mesh = icosphere(1)
    model = _model(seed=4)
    state = _state(mesh, generator).requires_grad_()
    masks = [_mask(len(mesh.vertices), generator) for _ in range(2)]
    leaves = [state, *model.parameters()]

    def value():
        x = state
        for mask in masks:
            x = model.step(x, mesh, mask)
        return x.double().square().sum()

    slopes = torch.autograd.grad(value(), leaves)
    for leaf, slope in zip(leaves, slopes, strict=True):
        direction = torch.randn(leaf.shape, generator=generator)
        with torch.no_grad():
            leaf += 1e-3 * direction
            above = value()
            leaf -= 2e-3 * direction
            below = value()
            leaf += 1e-3 * direction
        assert ((above - below) / 2e-3).item() == pytest.approx((slope * direction).sum().item(), rel=1e-2)


def test_a_state_without_gradient_gets_none(mesh, generator):
    """The first step from the pool; the parameters' gradients are the same."""
    model = _model()
    state = _state(mesh, generator)
    gradients = []
    for x in (state, state.clone().requires_grad_()):
        model.zero_grad()
        model.step(model.step(x, mesh), mesh).square().sum().backward()
        gradients.append([p.grad.clone() for p in model.parameters() if p.grad is not None])
    assert len(gradients[0]) == 4
    assert all(torch.equal(a, b) for a, b in zip(*gradients, strict=True))


def test_only_masked_cells_change(mesh, generator):
    model = _model()
    state, mask = _state(mesh, generator), _mask((2, len(mesh.vertices)), generator)
    after = model.step(state, mesh, mask)
    assert torch.equal(after[~mask], state[~mask])
    assert (after[mask] != state[mask]).all(-1).all()


def test_nobody_updates(mesh, generator):
    model = _model()
    state = _state(mesh, generator).requires_grad_()
    after = model.step(state, mesh, torch.zeros(len(mesh.vertices), dtype=torch.bool))
    assert torch.equal(after, state)
    slopes = torch.autograd.grad(after.sum(), [state, *model.parameters()])
    assert torch.equal(slopes[0], torch.ones_like(state))
    assert not any(slope.any() for slope in slopes[1:])


def test_a_seed_without_masks_stays_the_same_everywhere():
    """Nothing breaks the symmetry; that is what masks are for."""
    mesh, model = torus(8, 6), _model(16, 32)
    state = model.seed(mesh)
    assert state.shape == (1, len(mesh.vertices), 16) and not state.any()
    for _ in range(10):
        state = model.step(state, mesh)
    assert state.abs().max() > 0.01
    assert (state - state[:, :1]).abs().max() < 1e-5 * state.abs().max()
    broken = model.evolve(model.seed(mesh), mesh, 10, torch.Generator().manual_seed(0))
    assert (broken - broken[:, :1]).abs().max() > 0.01


def test_evolution_is_steps_with_fresh_masks(mesh):
    model = _model()
    generator = torch.Generator().manual_seed(5)
    state = model.seed(mesh, batch=2)
    for _ in range(3):
        state = model.step(state, mesh, torch.rand(2, len(mesh.vertices), generator=generator) < 0.5)
    again = model.evolve(model.seed(mesh, batch=2), mesh, 3, torch.Generator().manual_seed(5))
    assert torch.equal(again, state)
    other = model.evolve(model.seed(mesh, batch=2), mesh, 3, torch.Generator().manual_seed(6))
    assert not torch.equal(other, state)


def test_half_of_the_cells_update():
    mesh, model = icosphere(16), _model()
    after = model.evolve(model.seed(mesh), mesh, 1, torch.Generator().manual_seed(0))
    share = (after != 0).any(-1).float().mean().item()
    assert share == pytest.approx(0.5, abs=0.04)  # four standard deviations


def test_initial_weights_are_the_authors():
    """Xavier normal: std gain sqrt(2 / (inputs + outputs)); and they follow the seed."""
    model = MeshNCA()
    model.initialise(torch.Generator().manual_seed(0))
    assert model.fc1.weight.std().item() == pytest.approx(0.2 * (2 / (80 + 128)) ** 0.5, rel=0.05)
    assert model.fc2.weight.std().item() == pytest.approx(1.2 * (2 / (128 + 16)) ** 0.5, rel=0.1)
    assert not model.fc2.bias.any()
    assert model.fc1.bias.abs().max() <= 80**-0.5
    assert model.fc1.bias.abs().max() > 0.9 * 80**-0.5
    twin = MeshNCA()
    twin.initialise(torch.Generator().manual_seed(0))
    assert torch.equal(twin.fc1.weight, model.fc1.weight)


@pytest.mark.parametrize(
    ("state", "mask", "problem"),
    [
        ((1, 33, 4), None, "state of shape"),
        ((1, 34, 5), None, "state of shape"),
        ((34, 4), None, "state of shape"),
        ((2, 34, 4), torch.ones(34), "mask of torch.float32"),
        ((2, 34, 4), torch.ones(33, dtype=torch.bool), "mask of"),
        ((2, 34, 4), torch.ones(3, 34, dtype=torch.bool), "mask of"),
        ((2, 34, 4), torch.ones(1, 34, dtype=torch.bool), "mask of"),
    ],
)
def test_shapes_that_do_not_fit(mesh, state, mask, problem):
    with pytest.raises(ConfigError, match=problem):
        _model().step(torch.zeros(state), mesh, mask)


@pytest.mark.parametrize(
    ("width", "shape", "problem"),
    [
        (0, (34, 3), "condition of width 3"),
        (3, None, "condition of width 0"),
        (3, (34, 2), "condition of width 2"),
        (3, (33, 3), "condition of shape"),
        (3, (5, 34, 3), "condition of shape"),
    ],
)
def test_conditions_that_do_not_fit(mesh, width, shape, problem):
    condition = None if shape is None else torch.zeros(shape)
    with pytest.raises(ConfigError, match=problem):
        _model(condition=width).step(torch.zeros(2, 34, 4), mesh, None, condition)


def test_degrees_that_do_not_fit(mesh):
    with pytest.raises(ConfigError, match="degree 3"):
        MeshNCA(degree=3)
    with pytest.raises(ConfigError, match="degree=1"):
        _model().step(torch.zeros(1, 34, 4), perception(mesh, 2))
