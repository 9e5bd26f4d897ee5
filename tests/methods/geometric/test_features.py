"""What the networks see, and how they move vertices."""

import math

import numpy as np
import pytest
import torch

from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.geometric.connectivity import FaceGraph
from mitex.methods.geometric.features import displaced, face_features, side_frames


def bumpy(seed: int = 0) -> Mesh:
    mesh = icosphere(4)
    rng = np.random.default_rng(seed)
    return mesh.with_vertices(mesh.vertices * (1 + rng.uniform(-0.2, 0.2, (len(mesh.vertices), 1))))


def graph_of(mesh: Mesh) -> FaceGraph:
    return FaceGraph.of(mesh.faces, len(mesh.vertices))


def rotation(seed: int = 0) -> np.ndarray:
    q, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
    return q if np.linalg.det(q) > 0 else -q


def lattice() -> Mesh:
    """Equilateral triangles of side 1 in a plane, the inner ones of which have three neighbours."""
    i, j = np.divmod(np.arange(36), 6)
    points = np.stack([j + 0.5 * i, i * math.sqrt(0.75), 0 * i], 1)
    a = (np.arange(5)[:, None] * 6 + np.arange(5)).ravel()
    return Mesh(points, np.concatenate([np.stack([a, a + 1, a + 6], 1), np.stack([a + 1, a + 7, a + 6], 1)]))


def test_the_flat_lattice():
    mesh = lattice()
    features = face_features(torch.tensor(mesh.vertices), graph_of(mesh))
    expected = torch.tensor([0, math.sqrt(0.75), 0, 1]).expand_as(features)
    assert torch.allclose(features, expected, atol=1e-6)  # on the boundary too: mirrored


def test_two_faces_by_hand():
    # The second face stands upright on the first one's side from (1, 0, 0) to (0, 2, 0).
    points = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 2, 0], [0.5, 1, 3]])
    graph = FaceGraph.of(np.array([[0, 1, 2], [2, 1, 3]]), 4)
    features = face_features(points, graph)
    root = math.sqrt(5)
    assert torch.allclose(features[0, 1], torch.tensor([0.0, 0, 3, root]), atol=1e-6)
    # Across the open side from (0, 0, 0) to (1, 0, 0): the own apex (0, 2, 0), mirrored.
    assert torch.allclose(features[0, 0], torch.tensor([-0.5, 2, 0, 1]), atol=1e-6)
    # From the upright face, whose normal is (2, 1, 0) / root up to sign, the origin lies 2 / root away.
    upright = features[1, 0]
    assert torch.allclose(upright[[1, 3]], torch.tensor([0.0, root]), atol=1e-6)
    assert abs(float(upright[2])) == pytest.approx(2 / root, abs=1e-6)
    assert float(upright[0]) == pytest.approx(
        (points[0] - points[1:3].mean(0)) @ (points[1] - points[2]) / root
    )


def test_frames_are_orthonormal_and_point_outwards():
    mesh = bumpy()
    frames, lengths = side_frames(torch.tensor(mesh.vertices), graph_of(mesh))
    assert torch.allclose(frames @ frames.mT, torch.eye(3).expand_as(frames), atol=1e-5)
    centres = torch.tensor(mesh.vertices)[torch.from_numpy(mesh.faces).long()].mean(1)
    assert ((frames[:, 0, 2] * centres).sum(1) > 0).all()
    assert (lengths > 0).all()


def test_features_do_not_change_under_rigid_motion():
    mesh = bumpy()
    moved = mesh.vertices @ rotation().T + [3.0, -1.0, 2.0]
    a, b = (
        face_features(torch.tensor(v, dtype=torch.float64), graph_of(mesh)) for v in (mesh.vertices, moved)
    )
    assert torch.allclose(a, b, atol=1e-5)


def test_features_follow_the_order_of_vertices_and_faces():
    mesh, rng = bumpy(), np.random.default_rng(1)
    new, faces = rng.permutation(len(mesh.vertices)), rng.permutation(len(mesh.faces))
    place = np.argsort(new)
    other = Mesh(mesh.vertices[new], place[mesh.faces][faces])
    a = face_features(torch.tensor(mesh.vertices), graph_of(mesh))
    b = face_features(torch.tensor(other.vertices), graph_of(other))
    assert torch.allclose(a[faces], b, atol=1e-6)
    turned = Mesh(mesh.vertices, np.roll(mesh.faces, 1, 1))  # another first corner: sides change places
    c = face_features(torch.tensor(turned.vertices), graph_of(turned))
    assert torch.allclose(a.roll(1, 1), c, atol=1e-6)


def test_the_mean_of_the_faces_moves_a_vertex():
    mesh = lattice()
    offsets = torch.tensor([0.0, 0.0, 0.3]).expand(len(mesh.faces), 3)
    moved = displaced(torch.tensor(mesh.vertices), graph_of(mesh), offsets)
    assert torch.allclose(moved - torch.tensor(mesh.vertices), torch.tensor([0.0, 0, 0.3]), atol=1e-6)


def test_a_corner_reads_the_frame_of_the_side_leaving_it():
    points = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    graph = FaceGraph.of(np.array([[0, 1, 2]]), 3)
    moved = displaced(points, graph, torch.tensor([[1.0, 0.0, 0.0]])) - points
    root = math.sqrt(0.5)
    assert torch.allclose(moved, torch.tensor([[1.0, 0, 0], [-root, root, 0], [0, -1, 0]]), atol=1e-6)
    outwards = displaced(points, graph, torch.tensor([[0.0, 1.0, 0.0]])) - points
    assert torch.allclose(outwards, torch.tensor([[0.0, -1, 0], [root, root, 0], [-1, 0, 0]]), atol=1e-6)


def test_displacements_turn_with_the_mesh():
    mesh, turn = bumpy(), rotation(2)
    graph = graph_of(mesh)
    offsets = torch.randn(len(mesh.faces), 3, generator=torch.Generator().manual_seed(0), dtype=torch.float64)
    points = torch.tensor(mesh.vertices, dtype=torch.float64)
    matrix = torch.from_numpy(turn)
    a = displaced(points, graph, offsets) @ matrix.T + 1.0
    b = displaced(points @ matrix.T + 1.0, graph, offsets)
    assert torch.allclose(a, b, atol=1e-5)


@pytest.mark.parametrize("points", [[[0, 0, 0], [0, 0, 0], [1, 0, 0]], [[0, 0, 0], [1, 0, 0], [2, 0, 0]]])
def test_faces_without_area_stay_finite(points):
    graph = FaceGraph.of(np.array([[0, 1, 2]]), 3)
    vertices = torch.tensor(points, dtype=torch.float32).requires_grad_()
    features = face_features(displaced(vertices, graph, torch.ones(1, 3)), graph)
    features.square().sum().backward()
    assert features.isfinite().all() and vertices.grad is not None and vertices.grad.isfinite().all()


def test_gradients_by_finite_differences():
    mesh = grid(2, 2)
    rng = np.random.default_rng(0)
    points = torch.tensor(mesh.vertices + rng.normal(0, 0.2, mesh.vertices.shape)).requires_grad_()
    offsets = torch.tensor(rng.normal(size=(len(mesh.faces), 3))).requires_grad_()
    graph = graph_of(mesh)
    torch.autograd.gradcheck(lambda p, o: face_features(displaced(p, graph, o), graph), (points, offsets))
