"""Templates, the fit of training meshes, and the report on it."""

from dataclasses import replace
from importlib import import_module

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.mesh import Mesh, grid, icosphere, torus
from mitex.methods.geometric.config import GeometricConfig
from mitex.methods.geometric.connectivity import FaceGraph
from mitex.methods.geometric.fit import training_meshes
from mitex.methods.geometric.hierarchy import Hierarchy, mean_edge
from mitex.methods.geometric.references import REFERENCES
from mitex.methods.geometric.report import report
from mitex.methods.geometric.template import find_template, normalised, topology
from tests.shapes import fan, moebius

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


def test_templates_follow_the_genus():
    assert topology(find_template(egg())) == (1, 0, 0) and len(find_template(egg()).faces) == 20
    ring = REFERENCES["warts"]()
    turn, _ = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))
    turned = ring.with_vertices(ring.vertices @ turn + [1.0, 2.0, 3.0])
    found = find_template(turned)
    assert topology(found) == (1, 1, 0) and len(found.faces) < 300
    # The template lies along the ring: all its vertices are near the reference.
    nearest = [np.linalg.norm(turned.vertices - v, axis=1).min() for v in found.vertices]
    assert max(nearest) < 0.2


def test_open_references_are_simplified():
    pytest.importorskip("pymeshlab")
    mesh = grid(20, 20)
    found = find_template(mesh)
    assert topology(found) == (1, 0, 1) and len(found.faces) < 100


def test_a_template_of_another_genus_is_refused():
    with pytest.raises(
        ConfigError, match=r"template torus has 1 pieces, genus 1.*reference egg has .* genus 0"
    ):
        find_template(egg(), torus())
    assert find_template(egg(), icosphere(2)).name == "icosphere2"


def test_normalised_meshes_share_a_box():
    reference, template = normalised(egg(), find_template(egg()))
    size = [np.ptp(mesh.vertices, axis=0).max() for mesh in (reference, template)]
    assert size[0] == pytest.approx(size[1], rel=1e-5)
    graph = FaceGraph.of(template.faces, len(template.vertices))
    assert float(mean_edge(torch.from_numpy(template.vertices), graph)) == pytest.approx(1, rel=1e-5)


def test_training_meshes_come_near_and_stay_sound():
    reference, template = normalised(egg(), find_template(egg()))
    meshes, reports = training_meshes(reference, template, QUICK)
    assert [len(v) for v in meshes] == [12, 42, 162]
    start = Hierarchy.of(template, 3).meshes[2]
    before = report(start, reference)
    assert reports[2].chamfer < 0.5 * before.chamfer and reports[2].normals < before.normals
    assert reports[2].flipped == reports[2].crossings == 0
    assert 0.5 < float(mean_edge(meshes[2], Hierarchy.of(template, 3).graphs[2])) < 1.5


def test_training_meshes_are_kept(monkeypatch):
    reference, template = normalised(egg(), find_template(egg()))
    first, _ = training_meshes(reference, template, replace(QUICK, steps=1, fit_steps=3))

    def unwanted(*_):
        raise AssertionError("found again")

    monkeypatch.setattr(import_module("mitex.methods.geometric.fit"), "fit_level", unwanted)
    again, _ = training_meshes(reference, template, replace(QUICK, steps=1, fit_steps=3))
    assert torch.equal(first[0], again[0])
    with pytest.raises(AssertionError, match="found again"):
        training_meshes(reference, template, replace(QUICK, steps=1, fit_steps=4))


def test_the_report_by_known_shapes():
    ball, larger = icosphere(16), icosphere(16)
    larger = larger.with_vertices(1.25 * larger.vertices)
    found = report(ball, larger)
    assert found.chamfer == pytest.approx(0.25 / 1.25, rel=0.02)
    assert found.hausdorff == pytest.approx(0.25 / 1.25, rel=0.1)
    assert found.normals < 4 and found.flipped == 0 and found.crossings == 0
    inside_out = Mesh(ball.vertices, ball.faces[:, ::-1])
    assert report(inside_out, ball).flipped == len(ball.faces)
    assert report(inside_out, ball).normals > 176
