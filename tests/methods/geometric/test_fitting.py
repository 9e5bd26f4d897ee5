"""A small real training, its model, and growing it on other meshes."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.errors import CheckpointError, ConfigError, MeshError
from mitex.mesh import Mesh, grid, icosphere, subdivide_midpoint, torus
from mitex.mesh.topology import boundary_edges
from mitex.methods import geometric
from mitex.methods.geometric import METHOD
from mitex.methods.geometric.references import find_reference
from mitex.methods.geometric.report import report
from mitex.methods.geometric.rollout import slerp
from mitex.methods.geometric.template import normalised, topology
from mitex.methods.geometric.texture import GeometricTexture
from mitex.methods.registry import bundled, method_of
from mitex.training import checkpoint
from mitex.training.locate import NAME
from tests.methods.geometric.small import bumpy, rough_reports, same_weights
from tests.shapes import collapsed, fan, moebius, pair, turned
from tests.training.contract import assert_same_checkpoint

pytestmark = pytest.mark.usefixtures("own_cache")
SMALL = [
    "steps=9",
    "level_steps=3",
    "fit_steps=40",
    "fit_samples=300",
    "checkpoint_every=4",
    "preview_every=0",
]


def hill() -> Mesh:
    flat = grid(16, 16)
    x, y, _ = flat.vertices.T
    return replace(flat.with_vertices(np.stack([x, y, 0.2 * np.cos(2 * x) * np.cos(2 * y)], 1)), name="hill")


@pytest.fixture(scope="module")
def run(tmp_path_factory):
    folder = tmp_path_factory.mktemp("runs") / "bumpy"
    with pytest.MonkeyPatch.context() as patch:
        rough_reports(patch)
        return folder, geometric.fit(bumpy(), folder, set=SMALL)


def test_the_run_folder(run):
    folder, texture = run
    assert {p.name for p in folder.iterdir()} >= {"config.toml", "metrics.jsonl", checkpoint.NAME, NAME}
    assert method_of(folder) == method_of(folder / NAME) == METHOD
    assert texture.levels == 3 and texture.about["steps"] == 9
    assert [level["faces"] for level in texture.about["fit"]] == [20, 80, 320]


def test_models_round_trip(run):
    folder, texture = run
    again = GeometricTexture.load(folder)
    assert dict(again.about) == dict(texture.about)
    mesh = icosphere(4)
    for seed in (0, 1):
        a, b = (t.apply(mesh, seed=seed).mesh.vertices for t in (texture, again))
        assert np.array_equal(a, b)


@pytest.mark.parametrize("damage", ["cut", "foreign", "nan", "noise", "shape", "missing"])
def test_what_is_no_model_is_refused(run, tmp_path, damage):
    from safetensors.torch import load_file, save_file

    source = run[0] / NAME
    path = tmp_path / NAME
    if damage == "cut":
        path.write_bytes(source.read_bytes()[:-100])
    elif damage == "foreign":
        save_file({"x": torch.zeros(3)}, path)
    elif damage == "nan":
        texture = GeometricTexture.load(source)
        with torch.no_grad():
            texture.generators[0].parameters[0][0, 0] = torch.nan
        texture.save(path)
        assert load_file(path)
    elif damage == "noise":
        texture = GeometricTexture.load(source)
        replace(texture, fixed=texture.fixed[1:]).save(path)
    elif damage == "shape":
        texture = GeometricTexture.load(source)
        texture.generators[0].parameters[0] = texture.generators[0].parameters[0][:1, :1]
        texture.save(path)
    message = "there is no model in" if damage == "missing" else "geometric texture"
    with pytest.raises(CheckpointError, match=message):
        GeometricTexture.load(tmp_path)


def test_the_mesh_is_split_on_every_level_but_the_first(run):
    mesh = torus(12, 6)
    for start, end, splits in ((0, 2, 2), (1, 2, 1), (2, 2, 0), (0, 0, 0), (None, None, 0)):
        asset = run[1].apply(mesh, start_level=start, end_level=end)
        assert len(asset.mesh.faces) == 4**splits * len(mesh.faces)
        assert np.array_equal(asset.mesh.faces, subdivide_midpoint(mesh, splits).faces)


def test_results_keep_place_and_size(run):
    """Scaling and moving the mesh scales and moves the result; the noise decides the rest."""
    mesh = icosphere(6)
    a = run[1].apply(mesh, seed=3).mesh.vertices
    b = run[1].apply(mesh.with_vertices(5 * mesh.vertices + [1, 2, 3]), seed=3).mesh.vertices
    assert np.allclose(5 * a + [1, 2, 3], b, atol=2e-3)
    assert not np.allclose(a, run[1].apply(mesh, seed=4).mesh.vertices, atol=1e-4)


def test_uvs_are_interpolated(run):
    mesh = grid(6, 6)
    asset = run[1].apply(mesh, start_level=1)
    expected = subdivide_midpoint(mesh).uv
    assert asset.mesh.uv is not None and expected is not None and np.array_equal(asset.mesh.uv, expected)


UNSOUND = [grid(5, 4), moebius(), fan(), turned(icosphere(3)), collapsed(icosphere(3)), pair(icosphere(3))]


@pytest.mark.parametrize("mesh", [torus(8, 4), *UNSOUND], ids=lambda mesh: mesh.name)
def test_open_and_unsound_meshes_are_displaced(run, mesh):
    """But for their borders."""
    moved = run[1].apply(mesh, start_level=1).mesh
    assert np.isfinite(moved.vertices).all()
    far = np.linalg.norm(moved.vertices - subdivide_midpoint(mesh).vertices, axis=1)
    inner = np.ones(len(far), bool)
    inner[boundary_edges(moved.faces, len(far))] = False
    assert (far[inner] > 1e-3).mean() > 0.9 and far.max() < 2 * np.ptp(mesh.vertices, axis=0).max()
    assert far[~inner].max(initial=0.0) < 1e-6


def test_faces_that_name_a_vertex_twice_are_refused(run, tmp_path):
    ball = bumpy()
    mesh = replace(ball, faces=np.concatenate([ball.faces, [[0, 0, 1]]]))
    with pytest.raises(MeshError, match="bumpy has faces that name a vertex twice: 1"):
        run[1].apply(mesh)
    with pytest.raises(MeshError, match="bumpy has faces that name a vertex twice: 1"):
        geometric.fit(mesh, tmp_path / "run", set=SMALL)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize("mesh", [moebius(), fan(), turned(bumpy())], ids=lambda mesh: mesh.name)
def test_references_without_two_sides_are_refused(tmp_path, mesh):
    with pytest.raises(ConfigError, match="not a surface with two sides"):
        geometric.fit(mesh, tmp_path / "run", set=SMALL)
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("mesh", "template"),
    [(hill(), grid(2, 2)), (pair(bumpy()), pair(icosphere(1))), (collapsed(bumpy()), None)],
    ids=["open", "two components", "faces without area"],
)
def test_references_that_are_learned(tmp_path, mesh, template):
    """Their training meshes come near (templates are 0.04 to 0.12 away) and keep pieces and boundaries."""
    texture = geometric.fit(mesh, tmp_path / "run", template=template, set=SMALL)
    assert texture.about["fit"][-1]["chamfer"] < 0.025
    assert topology(texture.generate(seed=1)) == topology(mesh)


def test_two_components_are_displaced_alike(run):
    """Without noise: the instance norm is taken over both."""
    two = pair(bumpy())
    moved = replace_about(run[1], noise=0.0).apply(two, start_level=2).mesh.vertices
    count = len(two.vertices) // 2
    assert np.allclose(moved[:count] + [3.0, 0, 0], moved[count:], atol=1e-3)
    assert not np.allclose(moved, two.vertices, atol=1e-2)


def test_edges_are_measured_again_if_wanted(run):
    """On the first level that changes nothing: the mesh's mean edge is 1 there."""
    mesh, again = bumpy(), replace_about(run[1], remeasure=True)
    for start, alike in ((2, True), (1, False)):
        a, b = (texture.apply(mesh, start_level=start).mesh.vertices for texture in (run[1], again))
        assert np.allclose(a, b, atol=1e-5) == alike


def replace_about(texture: GeometricTexture, **changes) -> GeometricTexture:
    return replace(texture, about={**texture.about, **changes})


@pytest.mark.parametrize(("start", "end"), [(-1, 2), (2, 1), (0, 3), (3, None)])
def test_levels_out_of_range(run, start, end):
    with pytest.raises(ConfigError, match="this texture has the levels 0 to 2"):
        run[1].apply(icosphere(2), start_level=start, end_level=end)


def test_too_many_faces(run):
    with pytest.raises(ConfigError, match="remesh it more coarsely"):
        run[1].apply(icosphere(120), start_level=0)


def test_growth_starts_at_the_mesh_and_ends_at_the_result(run):
    mesh = icosphere(3)
    meshes = list(run[1].growth(mesh, frames=4, seed=2, start_level=1))
    assert [len(m.faces) for m in meshes] == [180] * 5 + [720] * 4
    assert np.array_equal(meshes[0].vertices, mesh.vertices)
    assert np.allclose(meshes[2].vertices, (meshes[0].vertices + meshes[4].vertices) / 2, atol=1e-6)
    assert np.allclose(meshes[-1].vertices, run[1].apply(mesh, seed=2, start_level=1).mesh.vertices)


def test_the_advice_is_for_the_levels_that_grow(run):
    """A growth that ends below the usual first level starts at its end."""
    mesh, texture = icosphere(3), run[1]
    assert texture.relative_size(mesh, end_level=1) == texture.relative_size(mesh, start_level=1)
    assert texture.relative_size(mesh, end_level=1) != texture.relative_size(mesh)


def test_interpolation_joins_two_seeds(run):
    mesh = icosphere(3)
    meshes = list(run[1].interpolate(mesh, (0, 1), 5))
    ends = [run[1].apply(mesh, seed=seed).mesh.vertices for seed in (0, 1)]
    assert np.allclose(meshes[0].vertices, ends[0], atol=1e-5)
    assert np.allclose(meshes[-1].vertices, ends[1], atol=1e-5)
    assert not np.allclose(meshes[2].vertices, ends[0], atol=1e-4)


def test_the_great_circle_keeps_the_variance():
    a, b = (torch.randn(5000, 3, generator=torch.Generator().manual_seed(k)) for k in range(2))
    for t in (0.0, 0.3, 0.5, 1.0):
        assert float(slerp(a, b, t).std()) == pytest.approx(1, abs=0.03)
    assert float(torch.lerp(a, b, 0.5).std()) < 0.75
    assert torch.allclose(slerp(a, a, 0.4), a)


def test_variations_of_the_reference(run):
    first, second = (run[1].generate(seed) for seed in (0, 1))
    assert len(first.faces) == 320 and not np.allclose(first.vertices, second.vertices, atol=1e-4)
    # From a level on that does not exist nothing is random: the reconstruction.
    reconstructions = [run[1].generate(seed, start_level=3).vertices for seed in (0, 1)]
    assert np.array_equal(reconstructions[0], reconstructions[1])


def test_resuming_changes_nothing(tmp_path, monkeypatch):
    rough_reports(monkeypatch)
    threads = torch.get_num_threads()
    torch.set_num_threads(1)
    try:
        whole = geometric.fit(bumpy(), tmp_path / "whole", set=SMALL)
        part = [*SMALL, "steps=5"]  # between two steps of one critic, whose optimizer must go on too
        # As many levels from the start: what is trained must not depend on where a run was cut.
        geometric.fit(bumpy(), tmp_path / "part", set=part)
        more = geometric.fit(bumpy(), tmp_path / "part", set=["steps=9"], resume=True)
    finally:
        torch.set_num_threads(threads)
    for a, b in zip(whole.generators, more.generators, strict=True):
        assert same_weights(a, b)
    assert_same_checkpoint(tmp_path / "whole", tmp_path / "part")


@pytest.mark.parametrize(
    ("name", "levels", "faces"),
    [("spikes", 5, 5120), ("scales", 1, 20480), ("knobs", 2, 20480), ("craters", 1, 20480)],
)
def test_bundled_models_are_found_by_name(name, levels, faces):
    """Without noise they rebuild their reference, about as near as the mesh that they were trained with;
    those that begin with its coarse part are a little farther."""
    assert name in bundled(METHOD) and method_of(name) == METHOD
    texture = GeometricTexture.load(name)
    assert texture.about["name"] == name and texture.levels == levels
    rebuilt = texture.generate(start_level=levels)
    assert len(rebuilt.faces) == faces
    reference, bound = normalised(find_reference(name), texture.template)[0], 1.2
    if texture.coarse is not None:  # its unit is an edge of the mesh without the relief
        size = (np.ptp(rebuilt.vertices, axis=0) / np.ptp(reference.vertices, axis=0)).mean()
        reference, bound = reference.with_vertices(size * reference.vertices), 1.5
    errors = report(rebuilt, reference)
    assert errors.chamfer < bound * texture.about["fit"][-1]["chamfer"]
    assert errors.normals < bound * texture.about["fit"][-1]["normals"]
