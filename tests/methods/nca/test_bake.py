"""Baked maps against the decoder at each texel's own point; normals in the surface's frames."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.atlas import Atlas, laid_out
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.nca import bake
from mitex.methods.nca.bake import GrownTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.decoder.decoder import Decoder
from mitex.methods.nca.decoder.surface import Points, Surface
from mitex.methods.nca.look import Look
from tests.mesh.solids import cube
from tests.methods.nca import tiny
from tests.methods.nca.brute_force import patchwork

ALL = ("albedo", "ambient_occlusion", "height", "normal", "roughness")


@pytest.fixture(scope="module")
def look():
    return tiny.texture(ALL).look


@pytest.fixture(scope="module")
def sphere():
    return laid_out(icosphere(3), 64)


def _grown(look: Look, mesh: Mesh, levels: int = 1, orientation: float = 0.0) -> GrownTexture:
    cells = Cells.of(mesh, levels)
    state = torch.rand(len(cells.mesh.vertices), 16, generator=torch.Generator().manual_seed(5)) - 0.5
    return GrownTexture(look, state, cells, orientation)


@pytest.fixture(scope="module")
def grown(look, sphere):
    return _grown(look, sphere)


def _constant(values) -> Look:
    """A look whose normal map is the same everywhere."""
    look = tiny.texture(("normal",)).look
    assert isinstance(look.decoder, Decoder)
    last = look.decoder.network.linear[-1]
    with torch.no_grad():
        last.weight.zero_()
        last.bias.copy_(torch.tensor(values) - 0.5)
    return look


def test_texels_are_the_decoder_at_their_points(grown, look, sphere):
    """Clipped to [0, 1], one texel after another: all maps but the normals, which are turned into frames."""
    atlas = Atlas.build(sphere, 64, 4, sphere.uv)
    maps = grown.textures(atlas)
    assert set(maps) == set(ALL)
    surface, cells = Surface(grown.cells.mesh), grown.cells
    rng = np.random.default_rng(0)
    inside = np.argwhere(atlas.inside)
    for row, column in inside[rng.integers(len(inside), size=40)]:
        face, barycentric = cells.locate(atlas.face[row, [column]], atlas.barycentric[row, [column]])
        points = Points(torch.from_numpy(face), torch.from_numpy(barycentric))
        with torch.no_grad():
            values = look.decoder(surface, grown.table, points)[0].clamp(0, 1).numpy()
        for name in ALL:
            if name != "normal":
                expected = values[list(look.layout[name])]
                assert np.allclose(maps[name][row, column], expected, atol=1e-5)
    assert all(values.min() >= 0 and values.max() <= 1 for values in maps.values())


def test_a_finer_map_shows_more(grown, sphere):
    """Detail between the vertices, rather than the same picture enlarged."""
    coarse, fine = (grown.textures(Atlas.build(sphere, n, 2, sphere.uv))["albedo"] for n in (32, 128))
    enlarged = coarse.repeat(4, 0).repeat(4, 1)
    atlas = Atlas.build(sphere, 128, 2, sphere.uv)
    assert np.abs(fine - enlarged)[atlas.inside].mean() > 0.1 * fine[atlas.inside].std()


def test_texels_without_a_chart_have_the_mean(grown, sphere):
    atlas = Atlas.build(sphere, 64, 2, sphere.uv)
    used = atlas.face >= 0
    assert 0.1 < used.mean() < 0.95
    for name, image in grown.textures(atlas).items():
        if name != "normal":
            assert np.allclose(image[~used], image[used].mean(axis=0), atol=1e-5)
        else:
            assert np.allclose(image[~used], [0.5, 0.5, 1], atol=0.01)


@pytest.mark.parametrize("size", [1, 100, 1000])
def test_the_size_of_chunks_does_not_matter(grown, sphere, monkeypatch, size):
    face, barycentric = np.arange(60, dtype=np.int32), np.full((60, 3), 1 / 3, np.float32)
    expected = grown.values(face, barycentric)
    monkeypatch.setattr(bake, "CHUNK", size)
    assert np.allclose(grown.values(face, barycentric), expected, atol=1e-6)
    assert grown.values(face[:0], barycentric[:0]).shape == (0, 9)


def test_padding_continues_the_charts(grown, sphere):
    """Every texel of the padding has a value that its chart has somewhere near."""
    atlas = Atlas.build(sphere, 64, 4, sphere.uv)
    image = grown.textures(atlas)["albedo"]
    for row, column in np.argwhere((atlas.face >= 0) & ~atlas.inside)[::25]:
        window = np.s_[max(row - 5, 0) : row + 6, max(column - 5, 0) : column + 6]
        near = image[window][atlas.inside[window]]
        assert (np.abs(near - image[row, column]).max(1).min() if len(near) else 0) < 0.15


def test_vertices_have_what_their_faces_show(grown, sphere):
    """From whichever face they are seen."""
    maps = grown.at_vertices()
    face = np.repeat(np.arange(len(sphere.faces), dtype=np.int32), 3)
    corner = np.tile(np.arange(3), len(sphere.faces))
    values = grown.values(face, np.eye(3, dtype=np.float32)[corner])
    columns = 0
    for name in ALL:
        width = maps[name].shape[1]
        expected = maps[name][sphere.faces[face, corner]]
        assert np.allclose(values[:, columns : columns + width], expected, atol=1e-4)
        columns += width
    assert columns == 9


def test_vertices_without_faces_are_finite(look):
    mesh = patchwork()
    maps = _grown(look, mesh).at_vertices()
    assert all(np.isfinite(values).all() and len(values) == len(mesh.vertices) for values in maps.values())


@pytest.mark.parametrize("levels", [0, 2])
def test_normals_of_a_flat_mesh_are_those_of_the_exemplar(levels):
    """Its UVs go to the right and up, as the exemplar does: encoded values stay, but for their length."""
    detail = np.array([0.36, 0.48, 0.8])
    mesh = grid(3, 3)
    image = _grown(_constant((detail + 1) / 2), mesh, levels).textures(Atlas.build(mesh, 32, 2, mesh.uv))
    assert np.allclose(image["normal"] * 2 - 1, detail, atol=2e-3)


@pytest.mark.parametrize("quarter", [1, 2, 3])
def test_orientation_turns_normals_counter_clockwise(quarter):
    detail, mesh = np.array([0.36, 0.48, 0.8]), grid(3, 3)
    atlas = Atlas.build(mesh, 32, 2, mesh.uv)
    image = _grown(_constant((detail + 1) / 2), mesh, 1, quarter * np.pi / 2).textures(atlas)["normal"]
    x, y, z = detail
    expected = {1: (-y, x, z), 2: (-x, -y, z), 3: (y, -x, z)}[quarter]
    assert np.allclose(image * 2 - 1, expected, atol=2e-3)


def test_normals_do_not_follow_the_uvs():
    """A layout turned by a quarter changes what is stored, so that the surface looks the same."""
    detail, mesh = np.array([0.36, 0.48, 0.8]), grid(3, 3)
    assert mesh.uv is not None
    turned = replace(mesh, uv=np.stack([1 - mesh.uv[..., 1], mesh.uv[..., 0]], -1))  # u points down
    image = _grown(_constant((detail + 1) / 2), turned).textures(Atlas.build(turned, 32, 2, turned.uv))
    x, y, z = detail
    assert np.allclose(image["normal"] * 2 - 1, (-y, x, z), atol=2e-3)


def test_an_even_normal_map_is_even_on_a_sphere(sphere):
    """Straight up: no detail at all, whichever way the frames turn."""
    atlas = Atlas.build(sphere, 64, 4, sphere.uv)
    image = _grown(_constant((0.5, 0.5, 1.0)), sphere).textures(atlas)["normal"]
    assert np.abs(image[atlas.inside] - [0.5, 0.5, 1]).max() < 0.02


def test_an_asset_has_the_mesh_its_maps_and_tangents(grown, sphere):
    asset = grown.asset()
    assert asset.mesh is sphere and tuple(asset.vertex_maps) == ALL and asset.name == sphere.name
    assert np.allclose(np.linalg.norm(asset.tangents, axis=1), 1, atol=1e-5)


def test_hard_edges_stay_hard(tmp_path):
    """A flat look on a cube with flat normals has a flat map: no round surface is painted over its edges."""
    (tmp_path / "cube.obj").write_text(cube().obj())
    mesh = laid_out(Mesh.load(tmp_path / "cube.obj"), 64, 2)
    assert mesh.corner_normals is not None
    atlas = Atlas.build(mesh, 64, 2, mesh.uv)
    image = _grown(_constant(np.array([0.5, 0.5, 1.0])), mesh).textures(atlas)["normal"]
    assert np.abs(image[atlas.inside] - np.array([0.5, 0.5, 1.0])).max() < 2e-3
