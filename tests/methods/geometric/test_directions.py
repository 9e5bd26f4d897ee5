"""Reliefs that follow a field: what networks see of it, how they move along it, and how it reaches a mesh."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from benchmarks.naive import face_network
from mitex.errors import CheckpointError, ConfigError
from mitex.evaluation.relief_direction import relief_direction
from mitex.geometry.vectors import across, unit
from mitex.mesh import Mesh, grid, icosphere, subdivide_midpoint, torus
from mitex.mesh.fields import vector_field
from mitex.methods import geometric
from mitex.methods.geometric.connectivity import FaceGraph
from mitex.methods.geometric.directions import face_directions, level_fields, spread
from mitex.methods.geometric.features import displaced, face_features
from mitex.methods.geometric.gan import generate
from mitex.methods.geometric.hierarchy import Hierarchy
from mitex.methods.geometric.model import network
from mitex.methods.geometric.network import largest
from mitex.methods.geometric.texture import GeometricTexture
from tests.methods.geometric.test_features import bumpy, rotation

pytestmark = pytest.mark.usefixtures("own_cache")
SMALL = ["steps=4", "level_steps=2", "fit_steps=10", "fit_samples=100", "preview_every=0"]
BOTH = pytest.mark.parametrize("symmetric", [False, True])


def directed(mesh: Mesh, field: str | np.ndarray, symmetric: bool) -> FaceGraph:
    hierarchy = Hierarchy.of(mesh, 1)
    return hierarchy.directed(
        spread(vector_field(mesh, field), hierarchy.pairs, symmetric), symmetric
    ).graphs[0]


def offsets(mesh: Mesh) -> torch.Tensor:
    return 0.1 * torch.randn(len(mesh.faces), 3, generator=torch.Generator().manual_seed(2))


@BOTH
def test_features_by_hand(symmetric):
    """The angle between each side and the field's part in the face's plane, one after the other."""
    mesh = bumpy()
    graph = directed(mesh, "0.3,1,0.2", symmetric)
    assert graph.directions is not None
    features = face_features(torch.tensor(mesh.vertices), graph)[..., 4:]
    assert features.shape == (len(mesh.faces), 3, 2)
    for f in range(0, len(mesh.faces), 17):
        corners = mesh.vertices[mesh.faces[f]].astype(np.float64)
        normal = unit(np.cross(corners[1] - corners[0], corners[2] - corners[0]))
        plane = unit(across(graph.directions[f].double().numpy(), normal))
        for k in range(3):
            x = unit(corners[(k + 1) % 3] - corners[k])
            outwards = unit(corners[k] - corners[(k + 2) % 3])
            outwards = unit(outwards - (outwards @ x) * x)
            angle = np.arctan2(plane @ outwards, plane @ x) * (2 if symmetric else 1)
            assert np.allclose(features[f, k], [np.cos(angle), np.sin(angle)], atol=1e-4)


def test_a_direction_fades_where_a_face_lies_across_it():
    graph = FaceGraph.of(np.array([[0, 1, 2]]), 3)
    points = torch.tensor([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])
    lengths = []
    for sine in (0.0, 0.05, 0.2, 1.0):
        direction = torch.tensor([[sine, 0.0, (1 - sine * sine) ** 0.5]])
        features = face_features(points, replace(graph, directions=direction))[..., 4:]
        lengths.append(float(features[0, 0].norm()))
    assert lengths == pytest.approx([0, 0.5, 1, 1], abs=1e-5)


@BOTH
def test_mesh_and_field_turn_together(symmetric):
    mesh, turn = bumpy(), rotation()
    field = vector_field(mesh, "0.3,1,0.2")
    other = mesh.with_vertices(mesh.vertices @ turn.T + [3.0, -1.0, 2.0])
    a, b = directed(mesh, field, symmetric), directed(other, field @ turn.T, symmetric)
    vertices = [torch.tensor(m.vertices, dtype=torch.float32) for m in (mesh, other)]
    assert torch.allclose(face_features(vertices[0], a), face_features(vertices[1], b), atol=1e-4)
    moved = [displaced(v, g, offsets(mesh)) for v, g in zip(vertices, (a, b), strict=True)]
    expected = moved[0].numpy() @ turn.T + [3.0, -1.0, 2.0]
    assert np.allclose(expected, moved[1], atol=1e-4)
    net = network(2, 3, torch.Generator().manual_seed(0), directed=True)
    grown = [generate(net, v, g) for v, g in zip(vertices, (a, b), strict=True)]
    assert np.allclose(grown[0].detach().numpy() @ turn.T + [3, -1, 2], grown[1].detach(), atol=1e-2)


def test_only_lines_have_no_sign():
    """Vertex by vertex: a line field may be told with any signs."""
    mesh = bumpy()
    field, rng = vector_field(mesh, "up"), np.random.default_rng(0)
    signs = rng.choice([-1.0, 1.0], len(field))[:, None]
    vertices, moves = torch.tensor(mesh.vertices), offsets(mesh)
    smooth, mixed = (directed(mesh, f, True) for f in (field, signs * field))
    assert torch.allclose(face_features(vertices, smooth), face_features(vertices, mixed), atol=1e-5)
    assert torch.allclose(displaced(vertices, smooth, moves), displaced(vertices, mixed, moves), atol=1e-5)
    ahead, back = (directed(mesh, f, False) for f in (field, -field))
    a, b = (face_features(vertices, g)[..., 4:] for g in (ahead, back))
    assert torch.allclose(a, -b, atol=1e-6) and a.abs().mean() > 0.3
    assert not torch.allclose(displaced(vertices, ahead, moves), displaced(vertices, back, moves), atol=1e-3)


def test_offsets_are_along_the_field_across_it_and_along_the_normal():
    """On a plane whose field is (0.6, 0.8, 0): all vertices move alike."""
    flat = grid(5, 4)
    graph, vertices = directed(flat, "0.6,0.8,0", False), torch.tensor(flat.vertices)
    for k, expected in enumerate(([0.6, 0.8, 0], [-0.8, 0.6, 0], [0, 0, 1])):
        moved = displaced(vertices, graph, 0.5 * torch.eye(3)[k].expand(len(flat.faces), 3))
        assert torch.allclose(moved - vertices, 0.5 * torch.tensor(expected).expand_as(vertices), atol=1e-6)


def test_offsets_of_lines_stretch_a_face():
    points = torch.tensor([[0.0, 0, 0], [3, 0, 0], [0, 3, 0]])
    graph = FaceGraph.of(np.array([[0, 1, 2]]), 3)
    graph = replace(graph, directions=torch.tensor([[1.0, 0, 0]]), symmetric=True)
    along = displaced(points, graph, torch.tensor([[0.5, 0.0, 0.0]])) - points
    across = displaced(points, graph, torch.tensor([[0.0, 0.5, 0.0]])) - points
    assert torch.allclose(along, torch.tensor([[-0.5, 0, 0], [1, 0, 0], [-0.5, 0, 0]]), atol=1e-6)
    assert torch.allclose(across, torch.tensor([[0, -0.5, 0], [0, -0.5, 0], [0, 1, 0]]), atol=1e-6)


@pytest.mark.parametrize("level", [0, 2])
def test_the_factored_network_equals_the_naive_one(level):
    mesh = bumpy()
    graph = directed(mesh, "up", False)
    features = face_features(torch.tensor(mesh.vertices), graph)
    net = network(level, 3, torch.Generator().manual_seed(level), directed=True)
    result = net(features, graph)
    assert torch.allclose(result, face_network(net, features, graph), atol=1e-4)
    both = net(torch.stack([features, 2 * features]), graph)
    assert torch.allclose(both[0], result, atol=1e-4)
    # Every layer sees the direction: with other guides of one of them alone the result is another.
    for layer in net.parameters[1:-1:2]:
        kept = layer.detach().clone()
        with torch.no_grad():
            layer[-2:] = 0
        assert not torch.allclose(net(features, graph), result, atol=1e-3)
        with torch.no_grad():
            layer.copy_(kept)


def test_the_largest_of_what_is_seen_across_sides():
    graph = FaceGraph.of(icosphere(3).faces, len(icosphere(3).vertices))
    rng = torch.Generator().manual_seed(0)
    x = torch.randn(2, len(graph), 5, generator=rng, requires_grad=True)
    shift = torch.randn(2, len(graph), 3, 5, generator=rng, requires_grad=True)
    slow = (x[:, graph.neighbours] + shift).amax(2)
    fast = largest(x, graph, shift)
    assert torch.equal(slow, fast)
    weight = torch.randn(slow.shape, generator=rng)
    for a, b in zip(
        *(torch.autograd.grad((r * weight).sum(), (x, shift)) for r in (slow, fast)), strict=True
    ):
        assert torch.allclose(a, b, atol=1e-6)


def test_neighbours_have_no_order():
    mesh = bumpy()
    graph = directed(mesh, "up", False)
    features = face_features(torch.tensor(mesh.vertices), graph)
    net = network(1, 3, torch.Generator().manual_seed(0), directed=True)
    turned = replace(graph, neighbours=graph.neighbours.roll(1, 1))
    assert torch.allclose(net(features.roll(1, 1), turned), net(features, graph), atol=1e-5)


@BOTH
def test_a_field_survives_splitting(symmetric):
    """As on the finer mesh itself; a line field with any signs."""
    mesh, rng = torus(24, 12), np.random.default_rng(0)
    field = vector_field(mesh, "about-y")
    if symmetric:
        field = field * rng.choice([-1, 1], len(field))[:, None]
    levels = spread(field, Hierarchy.of(mesh, 3).pairs, symmetric)
    for level, ours in enumerate(levels):
        expected = unit(vector_field(subdivide_midpoint(mesh, level), "about-y"))
        cos = (ours.numpy() * expected).sum(1)
        assert (np.abs(cos) if symmetric else cos).min() > 0.98


def test_opposite_vectors_cancel_and_opposite_lines_do_not():
    field = torch.tensor([[1.0, 0, 0], [-1, 0, 0], [0, 0, 0]])
    for symmetric, expected in ((False, 0.0), (True, 1.0)):
        direction = face_directions(field, torch.tensor([[0, 1, 2]]), symmetric)
        assert float(direction.norm()) == pytest.approx(expected, abs=1e-6)


def test_a_field_is_carried_to_training_meshes():
    """To the place, not to the number of the vertex."""
    ball, coarse = icosphere(12), icosphere(5)
    coarse = coarse.with_vertices(1.03 * coarse.vertices)
    (ours,) = level_fields(ball, vector_field(ball, "about-x"), [coarse])
    assert np.allclose(ours, unit(vector_field(coarse, "about-x")), atol=0.05)


def reference() -> Mesh:
    ball = icosphere(10)
    ribs = 1 + 0.1 * np.cos(4 * np.arctan2(ball.vertices[:, 0], ball.vertices[:, 2]))
    return replace(ball.with_vertices(ball.vertices * ribs[:, None]), name="ribs")


@pytest.fixture(scope="module", params=["vector", "line"])
def run(request, tmp_path_factory):
    """Two models of one start: with vectors, and with lines."""
    folder = tmp_path_factory.mktemp("runs") / request.param
    symmetric = f"symmetric={request.param == 'line'}".lower()
    return folder, geometric.fit(reference(), folder, field="up", set=[*SMALL, symmetric])


def grown(texture: GeometricTexture, mesh: Mesh, field, **options) -> np.ndarray:
    """Without noise, which would not turn with the mesh."""
    still = replace(texture, about={**texture.about, "noise": 0.0})
    return still.apply(mesh, field=field, **options).mesh.vertices.astype(np.float64)


def test_models_round_trip(run):
    folder, texture = run
    again = GeometricTexture.load(folder)
    assert again.about["field"] == texture.about["field"] == folder.name
    for a, b in zip(again.fields, texture.fields, strict=True):
        assert torch.equal(a, b)
    mesh = torus(12, 6)
    a, b = (t.apply(mesh, field="about-y", start_level=0).mesh.vertices for t in (texture, again))
    assert np.array_equal(a, b)


def test_results_turn_with_mesh_and_field(run):
    """With the field alone they become others."""
    mesh, turn = bumpy(), rotation(3)
    field = vector_field(mesh, "up")
    result = grown(run[1], mesh, field, start_level=0)
    both = grown(run[1], mesh.with_vertices(mesh.vertices @ turn.T), field @ turn.T, start_level=0)
    assert np.allclose(result @ turn.T, both, atol=2e-3)
    other = grown(run[1], mesh, np.cross(mesh.normals, field), start_level=0)
    assert np.abs(result - other).mean() > 1e-3


def test_only_lines_may_point_either_way(run):
    folder, texture = run
    mesh = bumpy()
    field = vector_field(mesh, "up")
    a, b = (grown(texture, mesh, f, start_level=0) for f in (field, -field))
    assert np.allclose(a, b, atol=1e-4) == (folder.name == "line")


def test_a_field_is_needed_where_one_was_learned(run):
    texture = run[1]
    with pytest.raises(ConfigError, match="follows a vector field; give a `field`, such as up"):
        texture.apply(torus(8, 4))
    for vectors in (np.zeros((32, 3)), np.full((32, 3), np.nan), np.ones((31, 3)), torus(8, 4).normals):
        with pytest.raises(ConfigError, match="the vector field is"):
            texture.apply(torus(8, 4), field=vectors)
    with pytest.raises(ConfigError, match="follows no `field`"):
        GeometricTexture.load("spikes").apply(torus(8, 4), field="up")


def test_the_template_has_its_own_field(run):
    """Other fields of it make other variations."""
    texture = run[1]
    variation = texture.generate(seed=1)
    turned = [torch.linalg.cross(field, torch.tensor([[0.0, 0.6, 0.8]])) for field in texture.fields]
    assert len(variation.faces) == 80
    other = replace(texture, fields=turned).generate(seed=1)
    assert np.abs(variation.vertices - other.vertices).max() > 1e-3


@pytest.mark.parametrize("damage", ["kind", "shape", "missing", "undirected"])
def test_what_is_no_model_is_refused(run, tmp_path, damage):
    texture = run[1]
    broken = {
        "kind": {"about": {**texture.about, "field": "cross"}},
        "shape": {"fields": [field[1:] for field in texture.fields]},
        "missing": {"fields": texture.fields[:1]},
        "undirected": {"about": {**texture.about, "field": None}},
    }[damage]
    path = replace(texture, **broken).save(tmp_path / "texture.safetensors")
    with pytest.raises(CheckpointError, match="geometric texture"):
        GeometricTexture.load(path)


def test_resuming_with_another_field_is_refused(run):
    folder, _ = run
    for field in ("right", None):
        with pytest.raises(ConfigError if field is None and folder.name == "line" else CheckpointError):
            geometric.fit(reference(), folder, field=field, set=["steps=6"], resume=True)


def test_symmetry_is_of_a_field(tmp_path):
    with pytest.raises(ConfigError, match="leave `symmetric` out"):
        geometric.fit(reference(), tmp_path / "run", set=[*SMALL, "symmetric=true"])
    assert not (tmp_path / "run").exists()


@pytest.mark.slow
def test_ribs_follow_the_field(tmp_path):
    """Learned upright; on another mesh they turn with the field. Minutes."""
    settings = ["steps=800", "level_steps=200", "fit_steps=200", "preview_every=0", "symmetric=true"]
    texture = geometric.fit("cactus", tmp_path / "run", field="up", set=settings)
    mesh = icosphere(9)
    up, base = vector_field(mesh, "up"), subdivide_midpoint(mesh)
    measured = [
        relief_direction(base, texture.apply(mesh, field=field).mesh, vector_field(base, "up"))
        for field in (up, np.cross(mesh.normals, up))
    ]
    assert abs(measured[0].turn) < 15 and measured[0].error < 35
    assert abs(measured[1].turn) > 75 and measured[1].error > 55
