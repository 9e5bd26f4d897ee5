"""The face convolutions, the losses and the scales."""

import numpy as np
import pytest
import torch

from benchmarks.naive import face_network
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.geometric.connectivity import FaceGraph
from mitex.methods.geometric.features import face_features
from mitex.methods.geometric.gan import critic_loss, generate, gradient_penalty
from mitex.methods.geometric.hierarchy import Hierarchy, mean_edge
from mitex.methods.geometric.model import network
from mitex.methods.geometric.network import largest, normalised


@pytest.fixture(scope="module")
def graph():
    mesh = icosphere(3)
    return FaceGraph.of(mesh.faces, len(mesh.vertices))


@pytest.fixture
def features(graph):
    return torch.randn(len(graph), 3, 4, generator=torch.Generator().manual_seed(1))


@pytest.mark.parametrize("level", [0, 1, 2, 5])
def test_the_factored_network_equals_the_naive_one(graph, features, level):
    net = network(level, 3, torch.Generator().manual_seed(level))
    a, b = net(features, graph), face_network(net, features, graph)
    assert a.shape == (len(graph), 3)
    assert torch.allclose(a, b, atol=1e-5)


@pytest.mark.parametrize(("level", "hidden", "thousands"), [(0, 160, 8.7), (1, 192, 10.9), (2, 288, 25.6)])
def test_parameters(level, hidden, thousands):
    """As published, with the biases before instance norms, which change nothing and are left out here."""
    net = network(level, 3, torch.Generator())
    count = sum(p.numel() for p in net.parameters) + hidden
    assert round(count / 1000, 1) == thousands


def test_batches_are_as_single_meshes(graph, features):
    net = network(2, 1, torch.Generator().manual_seed(0))
    both = net(torch.stack([features, 2 * features]), graph)
    assert torch.allclose(both[1], net(2 * features, graph), atol=1e-6)


def test_neighbours_have_no_order(graph, features):
    net = network(1, 3, torch.Generator().manual_seed(0))
    turned = FaceGraph(
        graph.faces, graph.neighbours.roll(1, 1), graph.opposite.roll(1, 1), graph.open, graph.incident
    )
    assert torch.equal(net(features.roll(1, 1), turned), net(features, graph))


def test_largest_and_normalised(graph):
    x = torch.randn(len(graph), 5, generator=torch.Generator().manual_seed(0))
    assert torch.equal(largest(x, graph), x[graph.neighbours].max(1).values)
    n = normalised(x)
    assert torch.allclose(n.mean(0), torch.zeros(5), atol=1e-6)
    assert torch.allclose(n.var(0, correction=0), torch.ones(5), atol=1e-3)


def test_without_weights_nothing_moves():
    mesh = icosphere(3)
    graph = FaceGraph.of(mesh.faces, len(mesh.vertices))
    net = network(0, 3, torch.Generator())
    net.load([torch.zeros_like(p) for p in net.parameters])
    vertices = torch.tensor(mesh.vertices)
    assert torch.equal(generate(net, vertices, graph), vertices)
    noise = 0.1 * torch.randn(vertices.shape, generator=torch.Generator().manual_seed(0))
    assert torch.equal(generate(net, vertices, graph, noise), vertices)


@pytest.mark.parametrize("remeasure", [False, True])
def test_what_is_generated_turns_with_the_mesh(remeasure):
    mesh = icosphere(3)
    graph = FaceGraph.of(mesh.faces, len(mesh.vertices))
    net = network(2, 3, torch.Generator().manual_seed(0))
    vertices = torch.tensor(mesh.vertices) * (1 + 0.1 * torch.sin(9 * torch.from_numpy(mesh.vertices[:, :1])))
    q, _ = torch.linalg.qr(torch.randn(3, 3, generator=torch.Generator().manual_seed(3)))
    q = q * torch.sign(torch.det(q))
    a = generate(net, vertices, graph, remeasure=remeasure) @ q.T + 2
    b = generate(net, vertices @ q.T + 2, graph, remeasure=remeasure)
    assert torch.allclose(a, b, atol=1e-3 if remeasure else 1e-4)
    if remeasure:
        doubled = generate(net, 2 * vertices, graph, remeasure=True)
        assert torch.allclose(doubled, 2 * generate(net, vertices, graph, remeasure=True), atol=1e-4)


def test_the_gradient_penalty_by_finite_differences(graph):
    net = network(0, 1, torch.Generator().manual_seed(0))
    net.parameters = [p.detach().double().requires_grad_() for p in net.parameters]
    features = torch.randn(len(graph), 3, 4, generator=torch.Generator().manual_seed(1), dtype=torch.float64)
    step, lengths = 1e-6, torch.zeros(len(graph), dtype=torch.float64)
    for k in range(12):
        for face in (0, 7, 50):
            moved = []
            for sign in (1, -1):
                shifted = features.clone()
                shifted.view(len(graph), 12)[face, k] += sign * step
                moved.append(float(net(shifted, graph).sum().detach()))
            lengths[face] += ((moved[0] - moved[1]) / (2 * step)) ** 2
    features.requires_grad_()
    (gradient,) = torch.autograd.grad(net(features, graph).sum(), features)
    for face in (0, 7, 50):
        assert float(gradient[face].norm()) == pytest.approx(float(lengths[face].sqrt()), rel=1e-5)
    expected = (gradient.flatten(1).norm(dim=1) - 1).square().mean()
    penalty = gradient_penalty(net, features, graph)
    assert float(penalty.detach()) == pytest.approx(float(expected), rel=1e-9)
    # Its own derivative, with respect to a weight: through the second backward pass.
    weight = net.parameters[1]
    (derivative,) = torch.autograd.grad(penalty, weight)
    values = []
    for sign in (1, -1):
        with torch.no_grad():
            weight[3, 5] += sign * step
        values.append(float(gradient_penalty(net, features, graph).detach()))
        with torch.no_grad():
            weight[3, 5] -= sign * step
    assert float(derivative[3, 5]) == pytest.approx((values[0] - values[1]) / (2 * step), rel=1e-4)


def test_the_critics_loss(graph, features):
    net = network(0, 1, torch.Generator().manual_seed(0))
    other = features + 0.3
    loss, distance = critic_loss(net, features, other, graph, torch.tensor(0.25), 0.5)
    scores = [net(f, graph).mean() for f in (features, other)]
    assert float(distance) == pytest.approx(float((scores[0] - scores[1]).detach()), abs=1e-6)
    between = 0.75 * features + 0.25 * other
    expected = 0.5 * gradient_penalty(net, between, graph) - (scores[0] - scores[1])
    assert float(loss.detach()) == pytest.approx(float(expected.detach()), rel=1e-5)


@pytest.mark.parametrize("mesh", [icosphere(1), grid(3, 2)])
def test_subdivision(mesh: Mesh):
    hierarchy = Hierarchy.of(mesh, 3)
    vertices = torch.tensor(mesh.vertices)
    for level in range(2):
        before = mean_edge(vertices, hierarchy.graphs[level])
        faces, edges = len(hierarchy.graphs[level]), len(hierarchy.pairs[level])
        count = len(vertices)
        vertices = hierarchy.finer(vertices, level)
        assert len(hierarchy.graphs[level + 1]) == 4 * faces and len(vertices) == count + edges
        assert torch.allclose(mean_edge(vertices, hierarchy.graphs[level + 1]), before, rtol=1e-5)
        expected = hierarchy.meshes[level + 1].vertices * 2 ** (level + 1)
        assert np.allclose(vertices.numpy(), expected, atol=1e-5)
    features = face_features(vertices, hierarchy.graphs[2])
    assert features.shape == (16 * len(mesh.faces), 3, 4)
