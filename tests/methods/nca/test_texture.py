"""Growing a texture on meshes of all kinds."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex import atlas
from mitex.atlas import laid_out
from mitex.errors import ConfigError
from mitex.mesh import Mesh, grid, icosphere, subdivide_loop, subdivide_midpoint
from mitex.methods.nca import NcaTexture, cells
from mitex.methods.nca.cells import Cells, scale_of_width
from mitex.methods.nca.orientation import rightwards
from mitex.methods.nca.perception import perception
from tests.methods.nca import tiny
from tests.methods.nca.brute_force import patchwork

ALL = ("albedo", "ambient_occlusion", "height", "normal", "roughness")


@pytest.fixture(scope="module")
def texture():
    return tiny.texture(ALL)


@pytest.fixture(scope="module")
def plain():
    """Without a decoder: the maps are channels of the state."""
    return tiny.texture(ALL, shape=None)


@pytest.fixture(scope="module")
def sphere():
    return icosphere(4)


def test_growth_is_steps_of_the_rule_from_the_seed(texture, sphere):
    """With states held where the training's were, and a little beyond."""
    look, generator = tiny.texture(ALL).look, torch.Generator().manual_seed(7)
    look.low.copy_(torch.linspace(-0.3, -0.02, 16))
    look.high.copy_(torch.linspace(0.01, 0.4, 16))
    width = look.high - look.low
    operator, state = perception(sphere, 1, mean=True), look.rule.seed(sphere)
    with torch.no_grad():
        for _ in range(5):
            mask = torch.rand(1, len(sphere.vertices), generator=generator) < 0.5
            state = look.rule.step(state, operator, mask)
            state = state.clamp(look.low - 0.05 * width, look.high + 0.05 * width)
    grown = NcaTexture(look).grow(sphere, seed=7, steps=5)
    assert torch.equal(grown, state[0])
    assert not torch.equal(grown, texture.grow(sphere, seed=7, steps=5))


def test_maps_are_those_of_the_state(plain, sphere):
    asset = plain.apply(sphere, seed=3, steps=20, subdivide=0, resolution=None)
    state = plain.grow(sphere, seed=3, steps=20).numpy()
    assert tuple(asset.vertex_maps) == ALL
    assert np.allclose(asset.vertex_maps["albedo"], np.clip(state[:, :3] + 0.5, 0, 1), atol=1e-6)
    assert np.allclose(asset.vertex_maps["normal"], np.clip(state[:, 7:10] + 0.5, 0, 1), atol=1e-6)
    occlusion = np.clip(state[:, 11:12] + 0.5, 0, 1)
    assert np.allclose(asset.vertex_maps["ambient_occlusion"], occlusion, atol=1e-6)
    assert asset.mesh is sphere
    for values in asset.vertex_maps.values():
        assert values.min() >= 0 and values.max() <= 1


def test_something_grows(texture, sphere):
    """More than what the decoder makes of no state at all."""
    grown, bare = (texture.apply(sphere, steps=s, subdivide=0, resolution=None) for s in (30, 0))
    assert np.abs(grown.vertex_maps["albedo"] - bare.vertex_maps["albedo"]).std(0).max() > 0.01


def test_the_seed_decides(texture, sphere):
    one, again, other = (texture.grow(sphere, seed=seed, steps=10) for seed in (5, 5, 6))
    assert torch.equal(one, again)
    assert (one - other).abs().max() > 1e-3


def test_no_steps_are_the_grey_seed(plain, sphere):
    asset = plain.apply(sphere, steps=0, subdivide=0, resolution=64)
    assert all((values == 0.5).all() for values in asset.vertex_maps.values())
    assert all((asset.texture_maps[name] == 0.5).all() for name in ALL if name != "normal")


def test_states_stay_bounded(sphere):
    """A rule that explodes; without a training the bounds are the authors', and a twentieth of their
    distance beyond.
    """
    wild = tiny.texture()
    with torch.no_grad():
        wild.look.rule.fc2.weight.mul_(100)
    state = wild.grow(sphere, steps=20)
    assert state.isfinite().all() and 1 < state.abs().max() <= 1.1 + 1e-6


def test_bounds_follow_the_training():
    """A fiftieth of the way in each step, channel by channel."""
    look = tiny.texture().look
    state = torch.linspace(-0.5, 0.9, 7)[:, None] * torch.linspace(0.1, 1, 16)
    for _ in range(2):
        look.track(state)
    share = 0.98**2
    assert torch.allclose(look.low, -share + (1 - share) * state.amin(0), atol=1e-6)
    assert torch.allclose(look.high, share + (1 - share) * state.amax(0), atol=1e-6)


def test_orientation_turns_the_growth_and_the_tangents(texture):
    """On a flat grid that faces +z: like the mesh turned the other way, with the same masks."""
    mesh = grid(6, 6)
    turned = mesh.with_vertices(mesh.vertices @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], np.float32))
    assert np.allclose(turned.vertices[:, 0], mesh.vertices[:, 1])  # by -90 degrees: y becomes x
    oriented = texture.grow(mesh, steps=10, orientation=90)
    assert torch.allclose(oriented, texture.grow(turned, steps=10), atol=1e-4)
    assert (oriented - texture.grow(mesh, steps=10)).abs().max() > 1e-3
    asset = texture.apply(mesh, steps=1, subdivide=0, orientation=90, resolution=None)
    assert asset.tangents is not None
    assert np.allclose(asset.tangents, [0, 1, 0], atol=1e-6)  # the exemplar's right points up


def test_tangents_point_to_the_right_of_an_upright_view():
    """Seen from outside with +y up; unit and across the normals, also at the poles."""
    sphere = icosphere(4)
    right = rightwards(sphere.normals)
    assert np.allclose(np.linalg.norm(right, axis=1), 1, atol=1e-6)
    assert np.abs((right * sphere.normals).sum(1)).max() < 1e-5
    front = np.argmax(sphere.normals[:, 2])
    assert np.dot(right[front], [1, 0, 0]) > 0.95
    assert np.abs(right[np.abs(sphere.normals[:, 1]) < 0.99, 1]).max() < 1e-5
    quarter = rightwards(sphere.normals, math.pi / 2)
    assert np.allclose(quarter, np.cross(sphere.normals, right), atol=1e-5)


@pytest.mark.parametrize("resolution", [None, 64])
@pytest.mark.parametrize("options", [{"subdivide": 0}, {"subdivide": 2}, {"scale": 1.2, "subdivide": 1}])
def test_the_mesh_comes_back_as_it_was_given(texture, resolution, options):
    """Vertices, order, faces, name and units, hard edges and UVs, to the last bit."""
    if "scale" in options:
        pytest.importorskip("pymeshlab")
    mesh = icosphere(3)
    mesh = replace(mesh.with_vertices(30 * mesh.vertices + 7), uv=atlas.unwrap(mesh, 64, 8), name="ball")
    asset = texture.apply(mesh, steps=2, resolution=resolution, **options)
    assert np.array_equal(asset.mesh.vertices, mesh.vertices)
    assert np.array_equal(asset.mesh.faces, mesh.faces)
    assert asset.mesh.uv is not None and mesh.uv is not None
    assert np.array_equal(asset.mesh.uv, mesh.uv)
    assert asset.mesh.name == asset.name == "ball"
    assert all(len(values) == len(mesh.vertices) for values in asset.vertex_maps.values())
    assert (asset.atlas is None) == (resolution is None)


@pytest.mark.parametrize("mesh", ["cube", "grid"])
def test_creases_and_corners_stay(texture, mesh):
    """Subdivision rounds the automaton's mesh only if it is asked for."""
    if mesh == "cube":
        corners = np.array(list(np.ndindex(2, 2, 2)), float)
        points = np.array(
            [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
        )
        given = Mesh(corners, np.concatenate([points[:, [0, 1, 2]], points[:, [0, 2, 3]]]))
    else:
        given = grid(2, 2)
    same, dense = (
        texture.apply(given, steps=1, subdivide=2, resolution=None, keep_dense=d).mesh for d in (False, True)
    )
    assert same is given
    assert len(dense.faces) == 16 * len(given.faces)
    assert np.array_equal(dense.vertices, subdivide_loop(given, 2).vertices)


def test_levels_of_subdivision(texture, sphere):
    """Without rounding, for the automaton alone; rounded where it is kept."""
    assert np.array_equal(Cells.of(sphere, 1).mesh.vertices, subdivide_midpoint(sphere, 1).vertices)
    once = texture.apply(sphere, steps=1, subdivide=1, resolution=None, keep_dense=True).mesh
    assert len(once.vertices) == 4 * len(sphere.vertices) - 6
    assert np.array_equal(once.vertices, subdivide_loop(sphere, 1).vertices)


def test_each_level_halves_the_pattern(plain):
    """On the same mesh: the grown albedo changes over half the distance."""
    mesh = icosphere(6)
    coarse, fine = (
        plain.apply(mesh, steps=30, subdivide=levels, resolution=256).texture_maps["albedo"]
        for levels in (0, 1)
    )
    change = [np.abs(np.diff(image, axis=0)).mean() / image.std() for image in (coarse, fine)]
    assert change[1] > 1.4 * change[0]


def test_automatic_subdivision(texture, sphere, monkeypatch):
    monkeypatch.setattr(cells, "ENOUGH_VERTICES", 600)
    assert len(Cells.of(sphere).mesh.vertices) == 642
    assert len(texture.apply(sphere, steps=1, resolution=None, keep_dense=True).mesh.vertices) == 642
    monkeypatch.setattr(cells, "ENOUGH_VERTICES", 162)
    assert Cells.of(sphere).mesh is sphere
    assert texture.apply(sphere, steps=1, resolution=None, keep_dense=True).mesh is sphere


def test_uvs_are_laid_out_before_the_subdivision(texture, sphere):
    expected = laid_out(sphere, 128)
    assert expected.uv is not None
    asset = texture.apply(sphere, steps=1, subdivide=1, resolution=128)
    assert asset.mesh.uv is not None
    assert np.array_equal(asset.mesh.uv, expected.uv)
    asset = texture.apply(sphere, steps=1, subdivide=1, resolution=128, keep_dense=True)
    finer = subdivide_loop(expected, 1).uv
    assert asset.mesh.uv is not None and finer is not None
    assert np.array_equal(asset.mesh.uv, finer)
    assert texture.apply(sphere, steps=1, subdivide=1, resolution=None).mesh.uv is None


@pytest.mark.parametrize("keep_dense", [False, True])
def test_uvs_are_looked_at_once(texture, sphere, monkeypatch, keep_dense):
    """The check of own UVs rasterizes them; what `apply` has laid out is baked on as it is."""
    calls = []
    for name in ("usable_uv", "unwrap"):
        original = getattr(atlas, name)
        monkeypatch.setattr(
            atlas, name, lambda *args, f=original, name=name: (calls.append(name), f(*args))[1]
        )
    options = {"steps": 1, "subdivide": 1, "resolution": 64, "keep_dense": keep_dense}
    baked = texture.apply(sphere, **options)
    assert calls == ["unwrap"]
    texture.apply(replace(sphere, uv=atlas.unwrap(sphere, 64, 8)), **options)
    assert calls == ["unwrap", "unwrap", "usable_uv"]
    assert np.array_equal(baked.atlas.uv, baked.mesh.uv)


@pytest.mark.parametrize("size", [1e-6, 2000.0, 1e7])
def test_place_and_units_do_not_matter(texture, size):
    """In a far corner of a world in any unit, the texture is that of the unit sphere."""
    sphere = icosphere(4)
    far = sphere.with_vertices(size * (sphere.vertices.astype(float) + (2.5, 0, 0.15)))
    moved, near = (texture.apply(m, steps=10, subdivide=1, resolution=None) for m in (far, sphere))
    for name in ALL:
        assert np.allclose(moved.vertex_maps[name], near.vertex_maps[name], atol=1e-2)


def test_a_larger_scale_has_fewer_cells(texture):
    pytest.importorskip("pymeshlab")
    sphere = icosphere(8)
    coarse = Cells.of(sphere, 0, 1.4)
    assert coarse.base is sphere and coarse.levels is None
    assert len(coarse.mesh.vertices) == pytest.approx(642 / 1.4**2, rel=0.15)
    assert np.allclose(np.ptp(coarse.mesh.vertices, axis=0), 2, atol=0.1)
    dense = texture.apply(sphere, steps=1, subdivide=0, scale=1.4, resolution=None, keep_dense=True).mesh
    assert len(dense.vertices) == pytest.approx(642 / 1.4**2, rel=0.15)


def test_the_exemplar_width_is_a_scale(sphere):
    pytest.importorskip("pymeshlab")
    texture = tiny.texture(ALL)
    texture = NcaTexture(texture.look, {**texture.about, "density": 24})
    scale = scale_of_width(sphere, 0.9, 24, 1)
    assert scale != pytest.approx(1, abs=0.05)
    options = {"steps": 5, "subdivide": 1, "resolution": None}
    one, other = (
        texture.apply(sphere, exemplar_width=0.9, **options),
        texture.apply(sphere, scale=scale, **options),
    )
    for name in ALL:
        assert np.array_equal(one.vertex_maps[name], other.vertex_maps[name])
    plain = texture.apply(sphere, **options)
    assert np.abs(one.vertex_maps["albedo"] - plain.vertex_maps["albedo"]).max() > 1e-3


def test_open_mesh_with_several_components_and_loose_vertices(texture):
    mesh = patchwork()
    asset = texture.apply(mesh, steps=15, subdivide=0, resolution=64)
    for values in asset.vertex_maps.values():
        assert np.isfinite(values).all()
    assert asset.tangents is not None and np.allclose(np.linalg.norm(asset.tangents, axis=1), 1, atol=1e-5)


def test_components_grow_by_themselves(texture):
    """The blob does not notice whether the patch is there: the same masks, the same pattern."""
    mesh = patchwork()
    blob = Mesh(mesh.vertices, mesh.faces[mesh.faces.min(1) >= 20])
    assert torch.equal(texture.grow(mesh, steps=10)[20:32], texture.grow(blob, steps=10)[20:32])


def test_nothing_is_left_in_the_gradient_tape(texture, sphere):
    assert not texture.grow(sphere, steps=2).requires_grad


def test_the_operator_of_a_mesh_is_built_once(texture, sphere):
    texture.grow(sphere, steps=1)
    operator = perception(sphere, mean=True)
    texture.grow(sphere, steps=1)
    assert perception(sphere, mean=True) is operator


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"steps": -1}, "-1 steps"),
        ({"subdivide": -1}, "subdivide = -1"),
        ({"subdivide": 7}, "subdivide = 7"),
        ({"subdivide": "much"}, "subdivide = much"),
        ({"subdivide": 1.5}, "subdivide = 1.5"),
        ({"scale": 0.0, "subdivide": 0}, "`scale` 0 is"),
        ({"scale": math.nan, "subdivide": 0}, "`scale` nan is"),
        ({"scale": 21, "subdivide": 0}, "`scale` 21 is"),
        ({"orientation": math.nan, "subdivide": 0}, "not finite"),
    ],
)
def test_unusable_options(texture, sphere, options, problem):
    with pytest.raises(ConfigError, match=problem):
        texture.apply(sphere, **options)


@pytest.mark.parametrize("options", [{"subdivide": 6}, {"subdivide": 2, "scale": 0.05}])
def test_too_many_vertices_are_refused_before_they_are_made(texture, options):
    with pytest.raises(ConfigError, match="more than 4,000,000 vertices"):
        texture.apply(icosphere(16), **options)


def test_a_model_with_a_condition_says_what_it_needs(sphere):
    """Before any work: 200 million steps would not end."""
    conditioned = tiny.texture(condition=4)
    for use in (conditioned.apply, conditioned.grow):
        with pytest.raises(ConfigError, match=r"'tiny' needs a condition of 4 values .*; .*MeshNCA\.evolve"):
            use(sphere, steps=200_000_000)
