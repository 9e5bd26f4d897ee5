"""States that are carried along: by a rule that changes nothing, and of textures that were not trained so."""

import numpy as np
import pytest
import torch
from scipy.spatial.transform import Rotation

from mitex.mesh import Lattice, icosphere, scattered_sphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.motion.advection import advection
from mitex.methods.nca.motion.cell_motion import tile_motion
from tests.methods.nca import tiny


def _pattern(points, turn=0.0):
    x, y, z = Rotation.from_rotvec([0, turn, 0]).inv().apply(points.astype(np.float64)).T
    return torch.from_numpy(np.stack([np.sin(5 * x), z * y, x * x], 1)).float()


@pytest.mark.parametrize("mesh", [icosphere(16), scattered_sphere(2562)], ids=["even", "uneven"])
def test_many_steps_turn_a_pattern(mesh):
    """By the sum of their angles, without washing it out: each step alone is a small part of an edge."""
    angle, steps = 0.01, 60
    carry = advection(mesh, angle * np.cross([0.0, 1.0, 0.0], mesh.vertices.astype(np.float64)))
    state = _pattern(mesh.vertices)
    for _ in range(steps):
        state = carry(state)
    turned = _pattern(mesh.vertices, steps * angle)
    assert (state - turned).square().mean() < 0.01 * (turned - _pattern(mesh.vertices)).square().mean()


def test_nothing_moves_where_there_is_no_way():
    mesh = icosphere(8)
    state = _pattern(mesh.vertices)
    assert torch.allclose(advection(mesh, np.zeros((len(mesh.vertices), 3)))(state), state, atol=1e-6)


def test_it_is_linear_and_has_its_adjoint_for_a_gradient():
    mesh = icosphere(6)
    carry = advection(mesh, 0.1 * np.cross([0.0, 1.0, 0.3], mesh.vertices.astype(np.float64)))
    a, b = torch.randn(2, len(mesh.vertices), 4, generator=torch.Generator().manual_seed(0))
    a.requires_grad_()
    (carry(a) * b).sum().backward()
    assert a.grad is not None
    assert (a.grad * b).sum().item() == pytest.approx((carry(b) * b).sum().item(), rel=1e-4)
    batch = torch.stack([a.detach(), b])
    assert torch.equal(carry(batch)[1], carry(b))


@pytest.mark.parametrize(("speed", "period"), [(1.0, 6.0), (2.0, 6.0), (1.0, 12.0)])
def test_a_field_carries_a_texture_that_was_not_trained_to_move(speed, period):
    """So many edges in a period, times the speed, where the field is as long as its mean."""
    texture = tiny.texture(shape=None)
    for weight in texture.look.rule.parameters():
        weight.data.zero_()
    about = {"name": "tiny"} if period == 6.0 else {"name": "tiny", "motion_period": period}
    mesh = icosphere(16)
    field = np.cross([0.0, 1.0, 0.0], mesh.vertices.astype(np.float64))
    motion = NcaTexture(texture.look, about).motion(Cells(mesh, 0, mesh), field, speed)
    assert motion.condition is None and motion.advection is not None
    state = torch.cat([_pattern(mesh.vertices), torch.zeros(len(mesh.vertices), 13)], 1)
    growth = NcaTexture(texture.look, about).growth(Cells(mesh, 0, mesh), 0.0, motion)
    after = growth.evolve(state, 12, torch.Generator())
    angle = 12 / period * speed * float(mesh.edge_lengths.mean()) / np.linalg.norm(field, axis=1).mean()
    error = (after[:, :3] - _pattern(mesh.vertices, angle)).square().mean()
    assert error < 0.01 * (after[:, :3] - state[:, :3]).square().mean()


@pytest.mark.parametrize(("speed", "period"), [(1.0, 6.0), (1.5, 6.0), (1.5, 12.0), (1.5, 4.0)])
def test_a_tile_is_carried_in_its_own_period(speed, period):
    lattice, look = Lattice.of(16), tiny.texture(shape=None).look
    about = {"name": "tiny"} if period == 6.0 else {"name": "tiny", "motion_period": period}
    motion = tile_motion(look, about, lattice, "right", speed)
    assert motion.condition is None and motion.advection is not None
    places = torch.from_numpy(lattice.mesh.vertices[: lattice.count, :1].astype(np.float64))

    def waves(way):
        return (2 * torch.pi * (places - way) / lattice.columns).sin().float()

    state = waves(0.0)
    for _ in range(12):
        state = motion.advection(state)
    assert torch.allclose(state, waves(12 * speed / period), atol=0.02)
