"""How thick a mesh is, and dents that no wall is too thin for."""

import numpy as np
import pytest
import torch

from mitex.mesh import Mesh, grid, icosphere, subdivide_midpoint
from mitex.methods.geometric.network import FaceNetwork
from mitex.methods.geometric.texture import GeometricTexture
from mitex.methods.geometric.thickness import DEEPEST, MOST, shallow, thickness


def shell(inner: float, frequency: int = 16) -> Mesh:
    """A hollow ball of radius 1."""
    ball = icosphere(frequency)
    faces = np.concatenate([ball.faces, ball.faces[:, ::-1] + len(ball.vertices)])
    return Mesh(np.concatenate([ball.vertices, inner * ball.vertices]), faces, name="shell")


def test_a_ball_is_as_thick_as_it_is_wide_a_shell_as_its_wall_and_a_sheet_has_no_end():
    fine = icosphere(8)
    assert thickness(icosphere(4)) == pytest.approx(2.0, rel=1e-3)
    assert thickness(fine) == pytest.approx(MOST * fine.edge_lengths.mean())  # which is less
    assert thickness(shell(0.8)) == pytest.approx(0.2, rel=0.01)
    flat = grid(8, 8)
    assert thickness(flat) == pytest.approx(MOST * flat.edge_lengths.mean())
    loose = Mesh(np.concatenate([flat.vertices, [[9, 9, 9]]]), flat.faces)
    assert np.isfinite(thickness(loose)).all()


def test_dents_stay_above_a_depth_and_bumps_as_they_are():
    ball, thick = icosphere(8), np.full(len(icosphere(8).vertices), 0.2)
    outward = np.linspace(-0.4, 0.4, len(thick))[:, None] * ball.normals
    aside = 0.1 * np.cross(ball.normals, [0.0, 0.0, 1.0])
    moved = shallow(ball, ball.with_vertices(ball.vertices + outward + aside), thick)
    move = moved.vertices - ball.vertices
    far, given = (move * ball.normals).sum(1), (outward * ball.normals).sum(1)
    assert np.allclose(move - far[:, None] * ball.normals, aside, atol=1e-5)
    assert np.allclose(far[given > 0], given[given > 0], atol=1e-5)
    assert (far > -DEEPEST * 0.2).all() and (np.diff(far) > -1e-6).all()
    assert np.allclose(far[abs(given) < 0.01], given[abs(given) < 0.01], atol=1e-4)


@pytest.fixture
def texture():
    rng = torch.Generator().manual_seed(0)
    template = icosphere(1)
    template = template.with_vertices(template.vertices / template.edge_lengths.mean())
    generators = [FaceNetwork((8, 8), 3, rng) for _ in range(4)]
    return GeometricTexture(generators, template, torch.zeros(12, 3), {"noise": 0.1, "remeasure": False})


def dented(generators, hierarchy, vertices, noises, remeasure):
    """In place of `grow`: every level two edges of the first one deep."""
    for level, mesh in enumerate(hierarchy.meshes):
        vertices = hierarchy.finer(vertices, level - 1) if level else vertices
        yield vertices - 2 * 2**level * torch.tensor(mesh.normals, dtype=torch.float32)


def test_dents_on_both_sides_of_a_wall_do_not_meet(texture, monkeypatch):
    """Of two edges each in a wall of three. As published, and on the template, none is drawn back."""
    monkeypatch.setattr("mitex.methods.geometric.rollout.grow", dented)
    monkeypatch.setattr("mitex.methods.geometric.texture.bumps", lambda mesh, edge: None)
    wall, middle = shell(0.8), 0.9
    for level in (2, 3):
        before = subdivide_midpoint(wall, level - 2).vertices
        after = texture.apply(wall, end_level=level).mesh.vertices
        outer = np.linalg.norm(before, axis=1) > middle
        assert np.array_equal(np.linalg.norm(after, axis=1) > middle, outer)
        assert np.linalg.norm(after - before, axis=1).min() > 0.3 * (1 - middle)
        bare = texture.apply(wall, end_level=level, placement="none").mesh.vertices
        assert np.array_equal(np.linalg.norm(bare, axis=1) > middle, ~outer)
    template = texture.template
    through = texture.generate(end_level=0).vertices
    assert np.allclose(through, template.vertices - 2 * template.normals, atol=1e-5)
