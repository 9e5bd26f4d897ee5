"""Mesh perception against loops over edges, and what it does not change under."""

import gc
import math
import weakref

import numpy as np
import pytest
import torch
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.spatial.transform import Rotation

from mitex.errors import ConfigError
from mitex.mesh import Mesh, grid, icosphere, torus
from mitex.methods.nca.perception import _cache, perception
from tests.mesh.examples import FAN, FAN_POINTS, meshes
from tests.methods.nca import brute_force
from tests.methods.nca.brute_force import patchwork, turned

BLOCKS = {0: 2, 1: 5, 2: 10}


@pytest.fixture
def generator():
    return torch.Generator().manual_seed(8)


def _state(mesh, generator, channels=3, batch=1):
    return torch.rand(batch, len(mesh.vertices), channels, generator=generator)


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_patchwork_against_the_loops(generator, degree):
    mesh = patchwork()
    state = _state(mesh, generator)
    vectors = perception(mesh, degree)(state)
    assert vectors.shape == (1, len(mesh.vertices), 3 * BLOCKS[degree])
    expected = torch.tensor(brute_force.perceive(mesh, state[0].tolist(), degree))
    assert torch.allclose(vectors[0], expected, atol=1e-5)


@settings(max_examples=25, deadline=None)
@given(meshes(), st.sampled_from([0, 1, 2]), st.integers(0, 99))
def test_any_mesh_against_the_loops(mesh, degree, seed):
    state = _state(mesh, torch.Generator().manual_seed(seed), channels=2)
    expected = torch.tensor(brute_force.perceive(mesh, state[0].tolist(), degree))
    assert torch.allclose(perception(mesh, degree)(state)[0], expected, atol=1e-5)


def test_one_vertex_by_hand():
    """The fan's centre sees three unit neighbours along x, y and z; blocks are Laplacian, y, z, x, state."""
    mesh = Mesh(FAN_POINTS, FAN)
    state = torch.tensor([[[1.0], [3.0], [10.0], [101.0]]])
    assert perception(mesh)(state)[0, 0].tolist() == pytest.approx([2 + 9 + 100, 9, 100, 2, 1], rel=1e-6)


def test_vertices_without_edges_see_only_themselves(generator):
    mesh = patchwork()
    state = _state(mesh, generator)
    alone = perception(mesh)(state)[0, -1]
    assert alone[:12].tolist() == [0] * 12
    assert torch.equal(alone[12:], state[0, -1])


def test_components_do_not_see_each_other(generator):
    mesh = patchwork()
    state = _state(mesh, generator)
    other = state.clone()
    other[:, 20:] = 7.0  # the patch is vertices 0 to 19
    assert torch.equal(perception(mesh)(state)[:, :20], perception(mesh)(other)[:, :20])


def test_coinciding_vertices_have_no_direction():
    mesh = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    vectors = perception(mesh)(torch.tensor([[[0.0], [1.0], [2.0]]]))
    assert vectors[0, 0].tolist() == [3, 0, 0, 0, 0]


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_place_and_size_of_the_mesh_do_not_matter(generator, degree):
    mesh = patchwork()
    state = _state(mesh, generator)
    moved = mesh.with_vertices(37.0 * mesh.vertices.astype(float) + (4.0, -2.0, 1.0))
    assert torch.allclose(perception(moved, degree)(state), perception(mesh, degree)(state), atol=1e-4)


@pytest.mark.parametrize("radius", [10.0**k for k in range(-12, 13, 2)])
@pytest.mark.parametrize("orientation", [0.0, 0.7])
def test_no_size_is_too_small_or_too_large(generator, radius, orientation):
    """The edges of the smallest one are 1e-13 long, far below any constant that looks small."""
    mesh = icosphere(8)
    state = _state(mesh, generator)
    sized = mesh.with_vertices(radius * mesh.vertices.astype(float))
    expected = perception(mesh, 2, orientation)(state)
    assert torch.allclose(perception(sized, 2, orientation)(state), expected, rtol=1e-5, atol=1e-5)


def test_a_constant_state_is_seen_as_no_change(generator):
    mesh = patchwork()
    vectors = perception(mesh, 2)(torch.full((1, len(mesh.vertices), 2), 0.7))
    assert torch.allclose(vectors[..., :18], torch.zeros(1), atol=1e-5)


def test_turning_the_mesh_turns_what_is_seen(generator):
    """The axes are those of the world: not invariant, but the three blocks of degree 1 turn as a vector."""
    mesh = patchwork()
    rotation = Rotation.from_rotvec([0.3, -1.1, 0.6])
    state = _state(mesh, generator)
    before = perception(mesh)(state)[0].view(-1, 5, 3)
    after = perception(turned(mesh, rotation))(state)[0].view(-1, 5, 3)
    assert torch.allclose(after[:, [0, 4]], before[:, [0, 4]], atol=1e-5)
    assert (after[:, 1:4] - before[:, 1:4]).abs().max() > 0.1
    matrix = torch.from_numpy(rotation.as_matrix()).float()
    axes = torch.tensor([3, 1, 2])  # x, y, z among the blocks
    expected = torch.einsum("ij,vjc->vic", matrix, before[:, axes])
    assert torch.allclose(after[:, axes], expected, atol=1e-5)


def test_a_quarter_turn_by_hand(generator):
    """About z, what pointed along x points along y: also in degree 2."""
    mesh = patchwork()
    state = _state(mesh, generator)
    before = perception(mesh, 2)(state)[0].view(-1, 10, 3)
    after = perception(turned(mesh, Rotation.from_rotvec([0, 0, math.pi / 2])), 2)(state)[0].view(-1, 10, 3)
    one, y, z, x, xy, yz, zz, xz, xx_yy, own = before.unbind(1)
    expected = torch.stack([one, x, z, -y, -xy, xz, zz, -yz, -xx_yy, own], 1)
    assert torch.allclose(after, expected, atol=1e-5)


@pytest.mark.parametrize("degree", [1, 2])
def test_orientation_is_the_loops_turned_back(generator, degree):
    mesh = patchwork()
    angles = np.linspace(-2, 3, len(mesh.vertices))
    state = _state(mesh, generator)
    expected = torch.tensor(brute_force.perceive(mesh, state[0].tolist(), degree, angles.tolist()))
    assert torch.allclose(perception(mesh, degree, angles)(state)[0], expected, atol=1e-5)


@pytest.mark.parametrize("angle", [math.pi / 2, 0.7])
def test_orientation_of_a_flat_grid_is_turning_it_the_other_way(generator, angle):
    """The grid faces +z: texture turned by +angle on a still mesh is a mesh turned by -angle under it."""
    mesh = grid(4, 4)
    state = _state(mesh, generator)
    oriented = perception(mesh, 2, angle)(state)
    rotated = perception(turned(mesh, Rotation.from_rotvec([0, 0, -angle])), 2)(state)
    assert torch.allclose(oriented, rotated, atol=1e-5)
    assert (oriented - perception(mesh, 2)(state)).abs().max() > 0.1


def test_one_angle_is_the_same_for_all(generator):
    mesh = patchwork()
    state = _state(mesh, generator)
    many = perception(mesh, 1, np.full(len(mesh.vertices), 0.4))(state)
    assert torch.allclose(perception(mesh, 1, 0.4)(state), many, atol=1e-6)


@pytest.mark.parametrize("degree", [0, 1, 2])
@pytest.mark.parametrize("batch", [1, 3])
def test_the_adjoint_is_the_transpose(generator, degree, batch):
    """<P x, y> = <x, P' y>."""
    mesh = patchwork()
    operator = perception(mesh, degree, 0.5)
    x = _state(mesh, generator, batch=batch)
    y = torch.rand(batch, len(mesh.vertices), 3 * operator.blocks, generator=generator)
    left = (operator(x).double() * y).sum()
    right = (x.double() * operator.transposed(y)).sum()
    assert left.item() == pytest.approx(right.item(), rel=1e-5)


def test_states_of_a_batch_do_not_touch_each_other(generator):
    mesh = patchwork()
    operator = perception(mesh)
    states = _state(mesh, generator, batch=3)
    alone = torch.cat([operator(state[None]) for state in states])
    assert torch.allclose(operator(states), alone, atol=1e-6)


def test_size_grows_with_edges_not_with_channels():
    """The matrix has an entry for each harmonic of an edge, and one row of them for the vertex itself."""
    mesh = icosphere(3)
    operator = perception(mesh, 1)
    assert operator.matrix.values().numel() == 4 * len(mesh.edges.indices) + 5 * len(mesh.vertices)


@pytest.mark.parametrize("degree", [0, 1, 2])
def test_the_mean_is_the_loops_by_valence(generator, degree):
    """Six times the sum over the number of neighbours; the state itself stays."""
    mesh = patchwork()
    state = _state(mesh, generator)
    expected = torch.tensor(brute_force.perceive(mesh, state[0].tolist(), degree))
    valence = torch.tensor([max(len(ring), 1) for ring in brute_force.neighbours(mesh)])
    expected[:, :-3] *= 6 / valence[:, None]
    assert torch.allclose(perception(mesh, degree, mean=True)(state)[0], expected, atol=1e-5)


@pytest.mark.parametrize("valence", [3, 4, 5, 6, 7, 12, 30])
def test_the_mean_is_as_large_at_any_valence(valence):
    """A cell among equal neighbours perceives the same, whichever their number."""
    angle = 2 * np.pi * np.arange(valence) / valence
    ring = np.column_stack([np.cos(angle), np.sin(angle), 0 * angle])
    k = np.arange(valence)
    wheel = Mesh(
        np.concatenate([np.zeros((1, 3)), ring]), np.column_stack([0 * k, 1 + k, 1 + (k + 1) % valence])
    )
    state = torch.ones(1, valence + 1, 1)
    state[0, 0] = 0
    laplacian = perception(wheel, mean=True)(state)[0, 0, 0].item()
    assert laplacian == pytest.approx(6, rel=1e-6)
    assert perception(wheel)(state)[0, 0, 0].item() == pytest.approx(valence, rel=1e-6)


def test_on_a_regular_mesh_the_mean_is_the_sum(generator):
    """To the last bit: training on a mesh of valence 6 is the same with both."""
    mesh = torus(12, 9)
    assert (np.diff(mesh.edges.indptr) == 6).all()
    state = _state(mesh, generator)
    assert torch.equal(perception(mesh, 2, mean=True)(state), perception(mesh, 2)(state))


@pytest.mark.parametrize("batch", [1, 3])
def test_the_adjoint_of_the_mean_is_its_transpose(generator, batch):
    mesh = patchwork()
    operator = perception(mesh, 1, 0.5, mean=True)
    x = _state(mesh, generator, batch=batch)
    y = torch.rand(batch, len(mesh.vertices), 3 * operator.blocks, generator=generator)
    left = (operator(x).double() * y).sum()
    assert left.item() == pytest.approx((x.double() * operator.transposed(y)).sum().item(), rel=1e-5)


def test_mean_and_sum_are_kept_apart():
    mesh = patchwork()
    assert perception(mesh, mean=True) is perception(mesh, mean=True) is not perception(mesh)


def test_operators_are_kept_while_the_mesh_lives():
    mesh = patchwork()
    assert perception(mesh) is perception(mesh)
    assert perception(mesh, 1, 0.5) is perception(mesh, 1, 0.5)
    assert perception(mesh, 1, 0.5) is not perception(mesh)
    assert perception(mesh, 0) is not perception(mesh)
    assert perception(mesh.with_vertices(mesh.vertices)) is not perception(mesh)
    operator, before = weakref.ref(perception(mesh)), len(_cache)
    del mesh
    gc.collect()
    assert operator() is None
    assert len(_cache) < before


@pytest.mark.parametrize(
    ("degree", "orientation", "problem"),
    [
        (3, 0.0, "degree 3"),
        (-1, 0.0, "degree -1"),
        (1, np.zeros(4), "orientations of shape"),
        (1, np.zeros((34, 1)), "orientations of shape"),
        (1, math.nan, "not finite"),
        (1, math.inf, "not finite"),
    ],
)
def test_unusable_options(degree, orientation, problem):
    with pytest.raises(ConfigError, match=problem):
        perception(patchwork(), degree, orientation)
