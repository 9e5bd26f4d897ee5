"""The flat square that a rule is trained on."""

import numpy as np
import pytest
import torch

from mitex.methods.nca.decoder.shape import DecoderShape
from mitex.methods.nca.look import Look
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.surfaces import CloseUps, TrainingPlane
from tests.methods.nca.tiny import SHAPE

COLUMNS = 16


def _look(shape: DecoderShape | None = SHAPE):
    look = Look(MeshNCA(), ("albedo",), shape)
    look.initialise(torch.Generator().manual_seed(0), gain=0.5)
    return look


def _ramp(plane):
    """A state whose first channels are the places of the cells in the square, in periods, minus a half."""
    inside = np.flatnonzero(np.bincount(plane.lattice.source) > 0)
    points = plane.lattice.mesh.vertices[: len(inside), :2] / COLUMNS
    state = torch.zeros(len(inside), 16)
    state[:, :2] = torch.from_numpy(points - 0.5)
    return state


def test_right_is_right_and_up_is_up():
    """What a window shows of a linear state is the place itself, away from the joined sides."""
    look = _look(None)
    plane = TrainingPlane.of(COLUMNS, look)
    whole = plane.whole(look, _ramp(plane), 64)[8:56, 8:56].detach()
    expected = (torch.arange(64) + 0.5)[8:56] / 64
    assert torch.allclose(whole[..., 0], expected.expand(48, 48), atol=1e-5)
    assert torch.allclose(whole[..., 1], expected.flip(0)[:, None].expand(48, 48), atol=1e-5)


def test_patches_have_their_width_and_stay_inside():
    look = _look(None)
    plane = TrainingPlane.of(COLUMNS, look)
    generator = torch.Generator().manual_seed(0)
    patches = plane.patches(look, _ramp(plane), CloseUps(4.0, 40, 8), generator).detach()
    steps = patches[:, 4, 4:, 0] - patches[:, 4, 3:-1, 0]
    interior = (patches[:, 4, :, 0] > 0.1).all(1) & (patches[:, 4, :, 0] < 0.9).all(1)
    assert interior.sum() > 20
    assert torch.allclose(steps[interior], torch.tensor(4.0 / COLUMNS / 8), atol=1e-4)
    assert patches[..., 0].std() > 0.15  # at many places
    # Twice as wide as the square: half of it, in half of the pixels.
    assert plane.patches(look, _ramp(plane), CloseUps(2.0 * COLUMNS, 1, 64), generator).shape == (
        1,
        32,
        32,
        3,
    )


def test_the_cells_are_those_of_a_torus():
    """A pattern moved by a column perceives the same, moved by a column: no cell has a border."""
    plane = TrainingPlane.of(COLUMNS, _look())
    rows = plane.lattice.rows
    state = torch.rand(rows, COLUMNS, 16, generator=torch.Generator().manual_seed(0))

    def perceived(grid):
        return plane.perception(grid.reshape(1, -1, 16)).view(rows, COLUMNS, -1)

    assert torch.allclose(perceived(state.roll(1, 1)), perceived(state).roll(1, 1), atol=1e-5)
    assert torch.allclose(perceived(state.roll(2, 0)), perceived(state).roll(2, 0), atol=1e-5)


def test_azimuth_turns_what_a_cell_perceives_and_not_what_is_seen():
    look = _look()
    front, side = (TrainingPlane.of(COLUMNS, look, azimuth) for azimuth in (0.0, 0.5 * np.pi))
    state = torch.rand(front.lattice.count, 16, generator=torch.Generator().manual_seed(0))
    blocks = [plane.perception(state[None]).view(-1, 5, 16) for plane in (front, side)]
    # 1, y, z, x, state: x of the front is -z of the side
    assert torch.allclose(blocks[0][:, [0, 1, 4]], blocks[1][:, [0, 1, 4]], atol=1e-4)
    assert torch.allclose(blocks[0][:, 3], -blocks[1][:, 2], atol=1e-4)
    plain = _look(None)
    one, other = (plane.whole(plain, state, 24) for plane in (front, side))
    assert torch.allclose(one, other, atol=1e-4)


def test_gradients_reach_state_and_decoder():
    look = _look()
    plane = TrainingPlane.of(COLUMNS, look)
    state = torch.rand(plane.lattice.count, 16, requires_grad=True)
    plane.patches(
        look, state, CloseUps(8.0, 2, 16), torch.Generator().manual_seed(0)
    ).square().sum().backward()
    assert state.grad is not None and (state.grad != 0).any(1).float().mean() > 0.2
    assert all(p.grad is not None and p.grad.any() for p in look.decoder.parameters())


@pytest.mark.parametrize("antialias", [1, 2])
def test_antialiased_pixels_are_means(antialias):
    look = _look()
    plane = TrainingPlane.of(COLUMNS, look)
    state = torch.rand(plane.lattice.count, 16, generator=torch.Generator().manual_seed(1))
    fine = plane.patches(look, state, CloseUps(8.0, 1, 16 * antialias), torch.Generator().manual_seed(0))
    coarse = plane.patches(look, state, CloseUps(8.0, 1, 16, antialias), torch.Generator().manual_seed(0))
    means = fine.view(1, 16, antialias, 16, antialias, 3).mean((2, 4))
    assert torch.allclose(coarse, means, atol=1e-5)
