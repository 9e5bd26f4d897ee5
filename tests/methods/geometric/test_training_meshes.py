"""Templates, the fit of training meshes, and the report on it."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.losses.chamfer import sample_surface
from mitex.mesh import Mesh, grid, icosphere, torus
from mitex.methods.geometric.config import GeometricConfig
from mitex.methods.geometric.connectivity import FaceGraph
from mitex.methods.geometric.fitting import training_meshes
from mitex.methods.geometric.hierarchy import Hierarchy, mean_edge
from mitex.methods.geometric.references import REFERENCES
from mitex.methods.geometric.report import report
from mitex.methods.geometric.template import find_template, normalised, topology
from mitex.methods.geometric.training_meshes import Fitting
from mitex.training.optim import Adam
from tests.methods.geometric.small import rough_reports
from tests.shapes import fan, moebius, pair

pytestmark = pytest.mark.usefixtures("own_cache")
QUICK = GeometricConfig(steps=3, level_steps=1, fit_steps=150, fit_samples=500)


def egg() -> Mesh:
    ball = icosphere(10)
    return replace(ball.with_vertices(ball.vertices * [0.7, 1.0, 0.7]), name="egg")


@pytest.mark.parametrize(
    ("mesh", "kind"),
    [(icosphere(2), (1, 0, 0)), (torus(), (1, 1, 0)), (grid(3, 3), (1, 0, 1))],
)
def test_topology(mesh, kind):
    assert topology(mesh) == kind


@pytest.mark.parametrize("mesh", [moebius(), fan()])
def test_what_has_no_two_sides_is_refused(mesh):
    with pytest.raises(ConfigError, match="not a surface with two sides"):
        topology(mesh)


@pytest.mark.parametrize("name", REFERENCES)
def test_references_are_sound(name):
    mesh = REFERENCES[name]()
    assert mesh.name == name
    assert topology(mesh) == ((1, 1, 0) if name == "warts" else (1, 0, 0))
    assert 50_000 < len(mesh.faces) < 70_000
    outwards = mesh.face_crosses * mesh.vertices[mesh.faces].mean(1)
    assert outwards.sum() > 0


def test_only_knobs_hang_over():
    """Seen from the centre, a height map's faces all show their backs; a mushroom's head shows faces too."""

    def share(name: str) -> float:
        mesh = REFERENCES[name]()
        return float(((mesh.face_crosses * mesh.vertices[mesh.faces].mean(1)).sum(1) < 0).mean())

    assert share("knobs") > 0.05
    assert share("spikes") == share("craters") == 0


def volume(mesh: Mesh) -> float:
    """Negative if it is inside out."""
    a, b, c = (mesh.vertices[mesh.faces[:, k]].astype(np.float64) for k in range(3))
    return float((a * np.cross(b, c)).sum() / 6)


def test_templates_follow_the_genus():
    assert topology(find_template(egg())) == (1, 0, 0) and len(find_template(egg()).faces) == 20
    for seed, ring in enumerate([REFERENCES["warts"](), *[torus(96, 48)] * 3]):
        turn, _ = np.linalg.qr(np.random.default_rng(seed).normal(size=(3, 3)))
        turned = ring.with_vertices(ring.vertices @ (turn * np.linalg.det(turn)) + [1.0, 2.0, 3.0])
        template = find_template(turned)
        assert topology(template) == (1, 1, 0) and len(template.faces) < 300
        # The template lies along the ring: all its vertices are near the reference. Its outside is outside.
        nearest = [np.linalg.norm(turned.vertices - v, axis=1).min() for v in template.vertices]
        assert max(nearest) < 0.2
        assert volume(template) == pytest.approx(volume(turned), rel=0.5)


def test_open_references_are_simplified():
    pytest.importorskip("pymeshlab")
    mesh = grid(20, 20)
    template = find_template(mesh)
    assert topology(template) == (1, 0, 1) and len(template.faces) < 100


def test_a_reference_that_loses_its_topology_when_simplified():
    """Two sheets on each other, which are joined."""
    sheet = grid(12, 12)
    vertices = np.concatenate([sheet.vertices, sheet.vertices])
    double = Mesh(vertices, np.concatenate([sheet.faces, sheet.faces + len(sheet.vertices)]), name="double")
    with pytest.raises(ConfigError, match="double, simplified to .* as a template") as error:
        find_template(double)
    assert error.value.remedy == "give a `template`"


def test_a_template_of_another_genus_is_refused():
    with pytest.raises(
        ConfigError, match=r"template torus has 1 pieces, genus 1.*reference egg has .* genus 0"
    ):
        find_template(egg(), torus())
    assert find_template(egg(), icosphere(2)).name == "icosphere2"


def test_normalised_meshes_share_a_box():
    reference, template = normalised(egg(), find_template(egg()))
    size = [np.ptp(mesh.vertices, axis=0) for mesh in (reference, template)]
    assert size[0] == pytest.approx(size[1], rel=0.2)  # 20 faces are less round
    assert size[0].max() == pytest.approx(size[1].max(), rel=1e-5)
    graph = FaceGraph.of(template.faces, len(template.vertices))
    assert float(mean_edge(torch.tensor(template.vertices), graph)) == pytest.approx(1, rel=1e-5)


def test_training_meshes_come_near_and_stay_sound():
    reference, template = normalised(egg(), find_template(egg()))
    meshes, reports = training_meshes(reference, template, QUICK)
    assert [len(v) for v in meshes] == [12, 42, 162]
    start = Hierarchy.of(template, 3).meshes[2]
    before = report(start, reference)
    assert reports[2].chamfer < 0.5 * before.chamfer and reports[2].normals < before.normals
    assert reports[2].flipped == reports[2].piercing == 0
    assert 0.5 < float(mean_edge(meshes[2], Hierarchy.of(template, 3).graphs[2])) < 1.5


@pytest.fixture
def fitting():
    """Of a square to a smaller one that is tilted and lies higher."""
    mesh, other = grid(3, 3), grid(2, 2)
    target = 0.5 * torch.tensor(other.vertices) @ torch.diag(torch.tensor([1.0, 1, 0])) + 1
    target[:, 2] += 0.8 * target[:, 0]
    config = GeometricConfig(fit_normals=0.3, fit_uniform=0.7, fit_entropy=0.5, fit_smooth=0.9)
    graph = FaceGraph.of(mesh.faces, len(mesh.vertices))
    return Fitting(graph, target, torch.tensor(other.faces).long(), config, 200), mesh


def test_the_distance_by_brute_force(fitting):
    """Section 3.1: the weights of both directions, and normals in both."""
    fit, mesh = fitting
    vertices = torch.tensor(mesh.vertices)
    generator = torch.Generator().manual_seed(3)
    ours = sample_surface(vertices, fit.graph.faces, 200, generator)
    theirs = sample_surface(fit.target, fit.target_faces, 200, generator)
    apart = torch.cdist(ours.points, theirs.points)
    cosines = ours.normals @ theirs.normals.T
    to = cosines.gather(1, apart.argmin(1)[:, None])
    back = cosines.gather(0, apart.argmin(0)[None])
    expected = 0.4 * apart.min(1).values.mean() + 0.6 * apart.min(0).values.mean()
    expected += 0.3 * ((1 - to).mean() + (1 - back).mean())
    distance = fit.distance(vertices, torch.Generator().manual_seed(3))
    assert float(distance) == pytest.approx(float(expected), rel=1e-5)


def test_the_regularity_by_hand(fitting):
    fit, mesh = fitting
    rng = np.random.default_rng(0)
    points = mesh.vertices + rng.normal(0, 0.1, mesh.vertices.shape).astype(np.float32)
    lengths, entropies, around = [], [], {v: set() for v in range(len(points))}
    for face in mesh.faces.tolist():
        sides = [float(np.linalg.norm(points[face[k]] - points[face[k - 1]])) for k in range(3)]
        lengths += sides
        entropies.append(-sum(s / sum(sides) * np.log(s / sum(sides)) for s in sides))
        for k in range(3):
            around[face[k]] |= {face[k - 1], face[k - 2]}
    rough = [np.abs(points[v] - points[list(near)].mean(0)).mean() for v, near in around.items()]
    expected = 0.7 * np.std(lengths, ddof=1) - 0.5 * np.mean(entropies) + 0.9 * np.mean(rough)
    assert float(fit.regularity(torch.from_numpy(points))) == pytest.approx(float(expected), rel=1e-5)


def test_steps_become_ten_times_smaller(fitting, monkeypatch):
    rates = []
    monkeypatch.setattr(Adam, "step", lambda self, rate: rates.append(rate))
    fit, mesh = fitting
    fit.config = replace(fit.config, fit_steps=10, fit_lr=0.1)
    vertices = 2 * torch.tensor(mesh.vertices)
    assert torch.equal(fit.run(vertices, torch.Generator()), vertices)
    assert rates[0] == pytest.approx(0.1 * float(mean_edge(vertices, fit.graph)))
    assert np.allclose(np.divide(rates[1:], rates[:-1]), 0.1**0.1)


def test_training_meshes_are_kept(monkeypatch):
    rough_reports(monkeypatch)
    reference, template = normalised(egg(), find_template(egg()))
    first, _ = training_meshes(reference, template, replace(QUICK, steps=1, fit_steps=3))

    def unwanted(*_):
        raise AssertionError("found again")

    monkeypatch.setattr(import_module("mitex.methods.geometric.fitting"), "fit_level", unwanted)
    again, _ = training_meshes(reference, template, replace(QUICK, steps=1, fit_steps=3))
    assert torch.equal(first[0], again[0])
    for other in ({"fit_steps": 4}, {"seed": 1}):
        with pytest.raises(AssertionError, match="found again"):
            training_meshes(reference, template, replace(QUICK, steps=1, **({"fit_steps": 3} | other)))


def test_the_report_by_known_shapes():
    ball, larger = icosphere(16), icosphere(16)
    larger = larger.with_vertices(1.25 * larger.vertices)
    errors = report(ball, larger)
    assert errors.chamfer == pytest.approx(0.25 / 1.25, rel=0.02)
    assert errors.hausdorff == pytest.approx(0.25 / 1.25, rel=0.1)
    assert errors.normals < 4 and errors.flipped == 0 and errors.piercing == 0
    # A ball beside it is missing; points of a sphere are 3 + 1 / 9 away from one that is 3 away, on average.
    missing, beyond = report(ball, pair(ball)), report(pair(ball), ball)
    assert missing.chamfer == pytest.approx((3 + 1 / 9 - 1) / 2 / 2 / 2.5, rel=0.03)
    assert missing.hausdorff == pytest.approx(3 / 2.5, rel=0.02)
    assert beyond.chamfer == pytest.approx(missing.chamfer * 2.5, rel=0.03)
    assert beyond.hausdorff == pytest.approx(3, rel=0.02)
    crossing = Mesh(np.concatenate([ball.vertices, ball.vertices + 0.7]), pair(ball).faces)
    assert report(crossing, ball).piercing > 9
    inside_out = report(Mesh(ball.vertices, ball.faces[:, ::-1]), ball)
    assert inside_out.flipped == len(ball.faces) and inside_out.normals > 176


def test_settings_that_read_alike_side_by_side_are_kept_apart(monkeypatch):
    """Seed 1 with 23 steps, and seed 12 with 3."""
    rough_reports(monkeypatch)
    reference, template = normalised(egg(), find_template(egg()))
    config = replace(QUICK, steps=1, fit_samples=100)
    one, other = (
        training_meshes(reference, template, replace(config, seed=seed, fit_steps=steps))[0][0]
        for seed, steps in ((1, 23), (12, 3))
    )
    assert not torch.equal(one, other)
