"""Open meshes keep their borders; a relief rises from there to its full height."""

import numpy as np
import pytest

from mitex.mesh import Mesh, grid, icosphere
from mitex.mesh.topology import boundary_edges
from mitex.methods.geometric import GeometricTexture
from mitex.methods.geometric.borders import REACH, with_borders


@pytest.fixture(scope="module")
def spikes():
    return GeometricTexture.load("spikes")


def open_ball() -> Mesh:
    """A ball without its lower part."""
    ball = icosphere(5)
    middles = ball.vertices[ball.faces][..., 1].mean(1)
    used, corners = np.unique(ball.faces[middles > -0.4], return_inverse=True)
    return Mesh(ball.vertices[used], corners.reshape(-1, 3).astype(np.int32), name="open")


def test_it_rises_smoothly_from_a_border():
    """On a flat square of side 2: by Hermite's step of the distance."""
    flat = grid(16, 16)
    up = flat.with_vertices(flat.vertices + np.array([0, 0, 0.3], np.float32))
    height = with_borders(flat, up, 0.5).vertices[:, 2] / 0.3
    distance = 1 - np.abs(flat.vertices[:, :2]).max(1)
    t = np.minimum(distance / 0.5, 1)
    np.testing.assert_allclose(height, t * t * (3 - 2 * t), atol=1e-6)


def test_a_closed_mesh_is_as_it_was():
    ball = icosphere(4)
    grown = ball.with_vertices(1.2 * ball.vertices)
    assert with_borders(ball, grown, 0.5) is grown


def test_only_what_is_near_along_the_surface_stays():
    """Neither another part beside the border, nor the other side of a fold."""
    sheet, ball = grid(4, 4), icosphere(4)
    vertices = np.concatenate([sheet.vertices, 0.1 * ball.vertices + np.array([0, 1.15, 0], np.float32)])
    both = Mesh(vertices, np.concatenate([sheet.faces, ball.faces + len(sheet.vertices)]))
    up = both.with_vertices(both.vertices + np.array([0, 0, 0.1], np.float32))
    after = with_borders(both, up, 0.5).vertices
    assert np.array_equal(after[len(sheet.vertices) :], up.vertices[len(sheet.vertices) :])
    assert not np.allclose(after[: len(sheet.vertices)], up.vertices[: len(sheet.vertices)])
    flat = grid(32, 32)
    x, y, _ = flat.vertices.astype(np.float64).T
    hairpin = np.stack([x, np.where(y < -0.4, -0.8 - y, y), 0.1 * (y < -0.4)], axis=1)
    folded = flat.with_vertices(hairpin)
    over = np.flatnonzero((np.abs(x) < 0.4) & (np.abs(y - 0.2) < 0.05))  # beside the lower border
    up = folded.with_vertices(hairpin + [0, 0, 0.3])
    assert np.allclose(with_borders(folded, up, 0.3).vertices[over], up.vertices[over])


@pytest.mark.parametrize("placement", ["even", "none"])
def test_borders_of_a_mesh_stay(spikes, placement):
    """Its loop is the same polygon afterwards; far from it the relief is that of the whole ball."""
    mesh = open_ball()
    last = spikes.apply(mesh, placement=placement).mesh
    ends = last.vertices[boundary_edges(last.faces, len(last.vertices))]
    corners = mesh.vertices[boundary_edges(mesh.faces, len(mesh.vertices))]
    split = 4  # of each edge, on two further levels
    assert len(ends) == split * len(corners)
    along = (corners[:, 1] - corners[:, 0])[:, None]
    points = (corners[:, :1] + np.linspace(0, 1, split + 1)[:, None] * along).reshape(-1, 3)
    nearest = np.linalg.norm(ends.reshape(-1, 1, 3) - points, axis=2).min(1)
    assert nearest.max() < 1e-5
    reach = REACH * mesh.edge_lengths.mean()
    far = last.vertices[:, 1] > -0.4 + 2 * reach
    assert np.abs(np.linalg.norm(last.vertices[far], axis=1) - 1).max() > 0.1


def test_they_stay_while_it_grows(spikes):
    mesh = open_ball()
    border = np.unique(boundary_edges(mesh.faces, len(mesh.vertices)))
    for one in spikes.growth(mesh, 2):
        np.testing.assert_allclose(one.vertices[border], mesh.vertices[border], atol=1e-6)
