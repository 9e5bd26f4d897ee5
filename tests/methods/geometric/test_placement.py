"""Bumps of a reference, and bumps like these on a mesh."""

from dataclasses import replace

import numpy as np
import pytest
import torch
from scipy.sparse.csgraph import dijkstra

from mitex.errors import ConfigError
from mitex.geometry.vectors import dot
from mitex.mesh import Mesh, grid, icosphere
from mitex.mesh.topology import mesh_edges
from mitex.methods.geometric.network import FaceNetwork
from mitex.methods.geometric.placement import SHARE_DOWN, SHARE_UP, Bumps, bumps, placed
from mitex.methods.geometric.rollout import between
from mitex.methods.geometric.texture import GeometricTexture

BALL = icosphere(12)
EDGE = float(BALL.edge_lengths.mean())


def moved(mesh, vertices):
    return np.flatnonzero(np.abs(vertices - mesh.vertices).max(1) > 0)


def graph(mesh):
    ends = mesh_edges(mesh.faces, len(mesh.vertices))[0]
    lengths = np.zeros((len(mesh.vertices),) * 2)
    lengths[ends[:, 0], ends[:, 1]] = np.linalg.norm(np.diff(mesh.vertices[ends], axis=1)[:, 0], axis=1)
    return lengths + lengths.T


@pytest.mark.parametrize("side", [1, -1])
def test_bumps_that_were_placed_are_found_again(side):
    given = Bumps(24.0, side * 2.0)
    measure = bumps(BALL.with_vertices(placed(BALL, given, 0)), EDGE)
    assert measure is not None
    assert measure.faces == pytest.approx(given.faces, rel=0.02)
    share = SHARE_UP if side > 0 else SHARE_DOWN
    assert share * given.height / measure.height == pytest.approx(1, abs=0.3)  # smoothing keeps a part


def test_what_has_no_separate_bumps():
    """A ball; with ridges around it, a single bump, low bumps, roughness, and bumps far apart."""
    points, rng = BALL.vertices.astype(np.float64), np.random.default_rng(0)
    ridges = points * (1 + 0.1 * np.cos(24 * points[:, 1:2]))
    single = points * (1 + 0.5 * (points[:, 1:2] > 0.97))
    low = placed(BALL, Bumps(24.0, 0.5), 0)
    rough = points + 0.05 * EDGE * rng.normal(size=points.shape)
    apart = placed(BALL, Bumps(60.0, 2.0), 0)
    for vertices in (points, ridges, single, low, rough, apart):
        assert bumps(BALL.with_vertices(vertices), EDGE) is None


def test_the_measure_turns_and_scales_with_the_mesh():
    vertices = placed(BALL, Bumps(24.0, 1.5), 0)
    turn = np.linalg.qr(np.random.default_rng(1).normal(size=(3, 3)))[0]
    turn *= np.linalg.det(turn)
    first = bumps(BALL.with_vertices(vertices), EDGE)
    second = bumps(BALL.with_vertices(7 * vertices @ turn.T + 3), 7 * EDGE)
    assert first == pytest.approx(second, rel=1e-3)


def test_each_bump_raises_a_vertex_along_its_normal():
    texture = Bumps(40.0, -1.5)
    vertices = placed(BALL, texture, 3)
    where = moved(BALL, vertices)
    assert len(where) == round(len(BALL.faces) / 40)
    ways = (vertices - BALL.vertices)[where]
    assert np.allclose(ways, -1.5 * SHARE_DOWN * EDGE * BALL.normals[where], atol=1e-3 * EDGE)


def test_bumps_are_farthest_from_each_other_along_the_edges():
    """Beside a slow search among all distances."""
    mesh, count = icosphere(5), 20
    away = dijkstra(graph(mesh))
    nodes = [int(np.random.default_rng(4).integers(len(mesh.vertices)))]
    while len(nodes) < count:
        nodes.append(int(np.argmax(away[nodes].min(0))))
    where = moved(mesh, placed(mesh, Bumps(len(mesh.faces) / count, 1.0), 4))
    ours = away[np.ix_(where, where)] + np.diag(np.full(count, np.inf))
    expected = away[np.ix_(nodes, nodes)] + np.diag(np.full(count, np.inf))
    assert ours.min() == pytest.approx(expected.min(), rel=1e-5)
    assert away[where].min(0).max() <= ours.min() + 1e-6  # no gap has room for another


def test_every_part_and_no_vertex_without_faces_gets_bumps():
    one, other = icosphere(6), icosphere(6)
    vertices = np.concatenate([one.vertices, other.vertices + 5, [[9, 9, 9]]])
    mesh = Mesh(vertices, np.concatenate([one.faces, other.faces + len(one.vertices)]))
    where = moved(mesh, placed(mesh, Bumps(30.0, 1.0), 0))
    halves = np.bincount(where // len(one.vertices), minlength=3)
    assert halves[0] == pytest.approx(halves[1], rel=0.25)
    assert halves[2] == 0


def test_few_faces_and_boundaries():
    assert len(moved(grid(2, 2), placed(grid(2, 2), Bumps(100.0, 1.0), 0))) == 0
    assert len(moved(grid(8, 8), placed(grid(8, 8), Bumps(0.1, 1.0), 0))) == len(grid(8, 8).vertices)


@pytest.fixture
def texture(monkeypatch):
    rng = torch.Generator().manual_seed(0)
    generators = [FaceNetwork((8, 8), 3, rng) for _ in range(4)]
    monkeypatch.setattr("mitex.methods.geometric.texture.bumps", lambda mesh, edge: Bumps(12.0, 2.0))
    template = icosphere(1)
    template = template.with_vertices(template.vertices / template.edge_lengths.mean())
    about = {"levels": 4, "noise": 0.1, "remeasure": False}
    return GeometricTexture(generators, template, torch.zeros(12, 3), about)


def test_growth_begins_with_the_bumps_unless_told_otherwise(texture, monkeypatch):
    mesh = icosphere(6)
    even = texture.apply(mesh, end_level=2).mesh.vertices
    none = texture.apply(mesh, end_level=2, placement="none").mesh.vertices
    assert np.abs(even - none).max() > 0.5 * mesh.edge_lengths.mean()
    raised = placed(mesh, Bumps(12.0, 2.0), 0)
    seen = []
    monkeypatch.setattr(
        "mitex.methods.geometric.rollout.grow", lambda g, h, v, *a: seen.append(v) or iter([v])
    )
    texture.apply(mesh, end_level=2)
    lengths = graph(mesh)
    unit = lengths[lengths > 0].mean()
    assert np.allclose(seen[-1].numpy() * unit, raised - mesh.vertices.mean(0), atol=1e-3 * unit)


def test_reliefs_without_bumps_and_those_that_follow_a_field_start_as_published(texture, monkeypatch):
    mesh = icosphere(6)
    none = texture.apply(mesh, placement="none").mesh.vertices
    monkeypatch.setattr("mitex.methods.geometric.texture.bumps", lambda mesh, edge: None)
    monkeypatch.setattr("mitex.methods.geometric.rollout.shallow", lambda before, after, thick: after)
    assert np.array_equal(texture.apply(mesh).mesh.vertices, none)
    directed = replace(texture, about={**texture.about, "field": "vector"})
    monkeypatch.setattr("mitex.methods.geometric.texture.placed", None)
    assert directed._placed(mesh, 2, "even", 0, "up") is mesh.vertices


def test_seeds_out_of_range_are_refused(texture):
    with pytest.raises(ConfigError, match="`seed`"):
        texture.apply(icosphere(2), seed=-1)


def test_the_template_gets_no_bumps(texture, monkeypatch):
    """There, lower levels place them: a film of it grows what `generate` makes."""
    monkeypatch.setattr("mitex.methods.geometric.texture.bumps", None)
    *_, last = texture.growth(texture.template, frames=1, seed=1, start_level=0, placement="even")
    assert np.allclose(last.vertices, texture.generate(1).vertices)


def test_an_unknown_placement_is_refused(texture):
    with pytest.raises(ConfigError, match="use even or none"):
        texture.apply(icosphere(2), placement="odd")


def test_the_reference_is_measured_as_the_first_generator_leaves_it(texture, monkeypatch):
    seen = []
    monkeypatch.setattr(
        "mitex.methods.geometric.texture.bumps", lambda mesh, edge: seen.append((len(mesh.faces), edge))
    )
    texture.apply(icosphere(4), start_level=1, end_level=2)
    assert seen == [(80, 0.5)]


def test_growths_and_changes_end_with_the_same_bumps(texture):
    mesh = icosphere(6)
    results = [texture.apply(mesh, seed=seed).mesh.vertices for seed in (0, 1)]
    *_, last = texture.growth(mesh, frames=1, seed=1)
    assert np.allclose(last.vertices, results[1])
    ends = list(texture.interpolate(mesh, (0, 1), 2))
    assert np.allclose(ends[0].vertices, results[0], atol=1e-5)
    assert np.allclose(ends[1].vertices, results[1], atol=1e-5)
    bare = [m.vertices for m in texture.interpolate(mesh, (0, 1), 2, placement="none")]
    assert not np.allclose(bare[0], results[0], atol=1e-2)
    *_, bare_growth = texture.growth(mesh, frames=1, seed=1, placement="none")
    assert np.allclose(bare_growth.vertices, bare[1], atol=1e-5)


def test_heights_between_two_seeds_keep_their_spread():
    start, stop = (placed(BALL, Bumps(24.0, 1.5), seed) for seed in (0, 1))
    assert between(BALL, start, stop, 0.0) is start
    assert between(BALL, start, stop, 1.0) is stop
    spread = [
        dot(between(BALL, start, stop, t) - BALL.vertices, BALL.normals).std() for t in (0.0, 0.25, 0.5, 1.0)
    ]
    assert spread == pytest.approx(spread[:1] * 4, rel=0.01)
    assert between(BALL, BALL.vertices, BALL.vertices, 0.5) == pytest.approx(BALL.vertices)


def test_films_between_two_seeds_go_along_them(texture, monkeypatch):
    seen = []
    monkeypatch.setattr(
        "mitex.methods.geometric.texture.between", lambda mesh, a, b, t: seen.append(t) or mesh.vertices
    )
    list(texture.interpolate(icosphere(2), (0, 1), 3))
    assert seen == [0, 0.5, 1]
