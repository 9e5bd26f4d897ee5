"""Growing a texture on meshes of all kinds."""

import math
from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex import atlas
from mitex.atlas import laid_out
from mitex.errors import ConfigError
from mitex.mesh import Mesh, grid, icosphere, subdivide_loop
from mitex.methods.nca import texture as room
from mitex.methods.nca.perception import perception
from mitex.methods.nca.texture import tangents
from tests.methods.nca import tiny
from tests.methods.nca.brute_force import patchwork

ALL = ("albedo", "ambient_occlusion", "height", "normal", "roughness")


@pytest.fixture(scope="module")
def texture():
    return tiny.texture(ALL)


@pytest.fixture(scope="module")
def sphere():
    return icosphere(4)


def test_growth_is_steps_of_the_rule_from_the_seed(texture, sphere):
    """With states held in [-1, 1], as in the authors' demo."""
    generator = torch.Generator().manual_seed(7)
    state = texture.model.seed(sphere)
    with torch.no_grad():
        for _ in range(5):
            mask = torch.rand(1, len(sphere.vertices), generator=generator) < 0.5
            state = texture.model.step(state, sphere, mask).clamp(-1, 1)
    assert torch.equal(texture.grow(sphere, seed=7, steps=5), state[0])


def test_maps_are_those_of_the_state(texture, sphere):
    asset = texture.apply(sphere, seed=3, steps=20, subdivide=0, resolution=None)
    state = texture.grow(sphere, seed=3, steps=20).numpy()
    assert tuple(asset.vertex_maps) == ALL
    assert np.allclose(asset.vertex_maps["albedo"], np.clip(state[:, :3] + 0.5, 0, 1))
    assert np.allclose(asset.vertex_maps["normal"], np.clip(state[:, 7:10] + 0.5, 0, 1))
    assert np.allclose(asset.vertex_maps["ambient_occlusion"], np.clip(state[:, 11:12] + 0.5, 0, 1))
    assert asset.mesh is sphere
    for values in asset.vertex_maps.values():
        assert values.min() >= 0 and values.max() <= 1


def test_something_grows(texture, sphere):
    albedo = texture.apply(sphere, steps=30, subdivide=0).vertex_maps["albedo"]
    assert albedo.std(0).max() > 0.01


def test_the_seed_decides(texture, sphere):
    one, again, other = (texture.grow(sphere, seed=seed, steps=10) for seed in (5, 5, 6))
    assert torch.equal(one, again)
    assert (one - other).abs().max() > 1e-3


def test_no_steps_are_the_grey_seed(texture, sphere):
    maps = texture.apply(sphere, steps=0, subdivide=0).vertex_maps
    assert all((values == 0.5).all() for values in maps.values())


def test_states_stay_bounded(sphere):
    """A rule that explodes."""
    wild = tiny.texture(ALL)
    with torch.no_grad():
        wild.model.fc2.weight.mul_(100)
    state = wild.grow(sphere, steps=20)
    assert state.isfinite().all() and state.abs().max() <= 1


def test_orientation_turns_the_growth_and_the_tangents(texture):
    """On a flat grid that faces +z: like the mesh turned the other way, with the same masks."""
    mesh = grid(6, 6)
    turned = mesh.with_vertices(mesh.vertices @ np.array([[0, -1, 0], [1, 0, 0], [0, 0, 1]], np.float32))
    assert np.allclose(turned.vertices[:, 0], mesh.vertices[:, 1])  # by -90 degrees: y becomes x
    oriented = texture.grow(mesh, steps=10, orientation=math.pi / 2)
    assert torch.allclose(oriented, texture.grow(turned, steps=10), atol=1e-4)
    assert (oriented - texture.grow(mesh, steps=10)).abs().max() > 1e-3
    asset = texture.apply(mesh, steps=1, subdivide=0, orientation=math.pi / 2)
    assert asset.tangents is not None
    assert np.allclose(asset.tangents, [0, 1, 0], atol=1e-6)  # the exemplar's right points up


def test_tangents_point_to_the_right_of_an_upright_view():
    """Seen from outside with +y up; unit and across the normals, also at the poles."""
    sphere = icosphere(4)
    right = tangents(sphere)
    assert np.allclose(np.linalg.norm(right, axis=1), 1, atol=1e-6)
    assert np.abs((right * sphere.normals).sum(1)).max() < 1e-5
    front = np.argmax(sphere.normals[:, 2])
    assert np.dot(right[front], [1, 0, 0]) > 0.95
    assert np.abs(right[np.abs(sphere.normals[:, 1]) < 0.99, 1]).max() < 1e-5
    quarter = tangents(sphere, math.pi / 2)
    assert np.allclose(quarter, np.cross(sphere.normals, right), atol=1e-5)


def test_levels_of_subdivision(texture, sphere):
    once = texture.apply(sphere, steps=1, subdivide=1).mesh
    assert len(once.vertices) == 4 * len(sphere.vertices) - 6
    assert np.array_equal(once.vertices, subdivide_loop(sphere, 1).vertices)


def test_automatic_subdivision(texture, sphere, monkeypatch):
    monkeypatch.setattr(room, "ENOUGH_VERTICES", 600)
    assert len(texture.apply(sphere, steps=1).mesh.vertices) == 642
    monkeypatch.setattr(room, "ENOUGH_VERTICES", 162)
    assert texture.apply(sphere, steps=1, resolution=None).mesh is sphere


def test_uvs_are_laid_out_before_the_subdivision(texture, sphere):
    asset = texture.apply(sphere, steps=1, subdivide=1, resolution=128)
    expected = subdivide_loop(laid_out(sphere, 128), 1).uv
    assert expected is not None and asset.mesh.uv is not None and np.array_equal(asset.mesh.uv, expected)
    assert texture.apply(sphere, steps=1, subdivide=1, resolution=None).mesh.uv is None


def test_uvs_are_looked_at_once(texture, sphere, monkeypatch):
    """The check of own UVs rasterizes them; what `apply` has laid out is baked on as it is."""
    calls = []
    for name in ("usable_uv", "unwrap"):
        original = getattr(atlas, name)
        monkeypatch.setattr(
            atlas, name, lambda *args, f=original, name=name: (calls.append(name), f(*args))[1]
        )
    baked = texture.apply(sphere, steps=1, subdivide=1, resolution=64)
    assert calls == ["unwrap"]
    texture.apply(replace(sphere, uv=atlas.unwrap(sphere, 64, 8)), steps=1, subdivide=1, resolution=64)
    assert calls == ["unwrap", "unwrap", "usable_uv"]
    assert np.array_equal(baked.atlas.uv, baked.mesh.uv)


def test_place_and_units_stay(texture):
    """In a far corner of a world in millimetres; the growth is that of the unit sphere."""
    sphere = icosphere(4)
    far = sphere.with_vertices(2000 * sphere.vertices + (5000, 0, 300))
    asset = texture.apply(far, steps=10, subdivide=1)
    assert np.allclose(asset.mesh.vertices.mean(0), (5000, 0, 300), atol=1)
    assert np.ptp(asset.mesh.vertices, axis=0).min() > 3800
    near = texture.apply(sphere, steps=10, subdivide=1)
    for name in ALL:
        assert np.allclose(asset.vertex_maps[name], near.vertex_maps[name], atol=1e-2)


def test_a_larger_scale_has_fewer_vertices(texture):
    pytest.importorskip("pymeshlab")
    sphere = icosphere(8)
    coarse = texture.apply(sphere, steps=1, subdivide=0, scale=1.4).mesh
    assert len(coarse.vertices) == pytest.approx(642 / 1.4**2, rel=0.15)
    assert np.allclose(np.ptp(coarse.vertices, axis=0), 2, atol=0.1)


def test_open_mesh_with_several_components_and_loose_vertices(texture):
    mesh = patchwork()
    asset = texture.apply(mesh, steps=15, subdivide=0)
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
    assert perception(sphere) is perception(sphere)


@pytest.mark.parametrize(
    ("options", "problem"),
    [
        ({"steps": -1}, "-1 steps"),
        ({"subdivide": -1}, "subdivide = -1"),
        ({"subdivide": 7}, "subdivide = 7"),
        ({"subdivide": "much"}, "subdivide = much"),
        ({"subdivide": 1.5}, "subdivide = 1.5"),
        ({"scale": 0.0, "subdivide": 0}, "scale = 0.0"),
        ({"scale": math.nan, "subdivide": 0}, "scale = nan"),
        ({"scale": 21, "subdivide": 0}, "scale = 21"),
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
    conditioned = tiny.texture(condition=3)
    for use in (conditioned.apply, conditioned.grow):
        with pytest.raises(ConfigError, match=r"'tiny' needs a condition of 3 values .*; .*MeshNCA\.evolve"):
            use(sphere, steps=200_000_000)
