"""Pictures of spheres whose colours, light and relief are known."""

import math
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.errors import ConfigError
from mitex.geometry.tangents import split_at_hard_edges, split_at_seams
from mitex.mesh import Mesh, icosphere
from mitex.render.renderer import OrbitRenderer, _facing, _material, _surface

SIDE = 24
SPHERE = icosphere(12)
GREY = {"albedo": np.full((len(SPHERE.vertices), 3), 0.735)}  # half, linear


def picture(
    asset: Asset, azimuth: float = 0.0, elevation: float = 0.0, spp: int = 16, **options: Any
) -> np.ndarray:
    renderer = OrbitRenderer(asset, resolution=SIDE, **options)
    return renderer.render(azimuth, renderer.fit_view(azimuth, elevation), spp)


def east(mesh: Mesh) -> np.ndarray:
    return np.stack([mesh.vertices[:, 2], 0 * mesh.vertices[:, 0], -mesh.vertices[:, 0]], axis=1)


def bent(x: float, y: float) -> Asset:
    """A grey sphere whose normals lean by (x, y) to the east and to the north everywhere."""
    n = np.array([x, y, math.sqrt(1 - x * x - y * y)])
    normal = np.tile(0.5 + 0.5 * n, (len(SPHERE.vertices), 1))
    return Asset(SPHERE, {**GREY, "normal": normal}, east(SPHERE))


def middle(image: np.ndarray) -> np.ndarray:
    return image[10:14, 10:14].mean(axis=(0, 1))


def test_background_is_white_and_the_exposure_right():
    image = picture(Asset(SPHERE, GREY), floating=True, spp=64)
    np.testing.assert_allclose(image[[0, 0, -1, -1], [0, -1, 0, -1]], 1.0, atol=1e-6)
    lit = image[6:12, 7:13]  # turned to the key light
    assert 0.35 < lit.mean() < 0.75  # of the half that it reflects
    # Neutral light: no visible tint.
    assert np.ptp(lit.mean(axis=(0, 1))) < 0.1 * lit.mean()


def test_paper_is_light_grey():
    image = picture(Asset(SPHERE, GREY), elevation=17)
    corners = image[[0, 0, -1], [0, -1, 0]]
    assert corners.min() > 0.6 and corners.max() < 1.1


def test_light_comes_from_the_upper_left_at_every_azimuth():
    renderer = OrbitRenderer(Asset(SPHERE, GREY), resolution=SIDE, floating=True)
    for azimuth in (0.0, 115.0, 230.0):
        image = renderer.render(azimuth, renderer.fit_view(azimuth, 0.0), 16).mean(axis=2)
        assert image[5:9, 6:10].mean() > 2.0 * image[15:19, 14:18].mean()


def test_azimuth_shows_the_named_side():
    x, _, z = np.abs(SPHERE.vertices).T
    albedo = np.stack([x > 0.6, z > 0.6, 0 * x], axis=1).astype(np.float32) * 0.8
    renderer = OrbitRenderer(Asset(SPHERE, {"albedo": albedo}), resolution=SIDE, floating=True)
    front, right = (middle(renderer.render(a, renderer.fit_view(a, 0.0), 16)) for a in (0.0, 90.0))
    assert front[1] > 5 * front[0] and right[0] > 5 * right[1]


def test_map_normals_that_lean_into_the_light_are_brighter():
    """The key light stands to the upper left, where -x and +y of the map point on the front."""
    west, eastern = (middle(picture(bent(x, 0.0), floating=True)).mean() for x in (-0.5, 0.5))
    north, south = (middle(picture(bent(0.0, y), floating=True)).mean() for y in (0.5, -0.5))
    assert west > 1.3 * eastern
    assert north > 1.3 * south


def test_no_pixel_is_black_where_normals_turn_away():
    for x, y in ((0.9, 0.0), (-0.9, 0.0), (0.0, 0.9)):
        assert picture(bent(x, y), floating=True, spp=64).min() > 0.01


def test_facing_changes_only_what_looks_away(rng):
    normals = np.tile([0.0, 0.0, 1.0], (3, 1))
    detail = np.array([[0.0, 0.0, 1.0], [0.8, 0.0, 0.6], [-0.8, 0.0, 0.6]])
    to_camera = np.tile([0.8, 0.0, 0.6], (3, 1))
    bent_back = _facing(detail, normals, to_camera)
    np.testing.assert_allclose(bent_back[:2], detail[:2])
    assert bent_back[2] @ to_camera[2] > 0.05
    # From behind an open surface, the other way round.
    behind = _facing(detail, normals, -to_camera)
    assert behind[2] @ -to_camera[2] < 0.0 or np.allclose(behind[2], detail[2])
    assert (np.einsum("nk,nk->n", behind, -to_camera) < 0).all()


def test_occlusion_darkens_the_base_colour():
    half = {**GREY, "ambient_occlusion": np.full((len(SPHERE.vertices), 1), 0.5)}
    asset = Asset(SPHERE, half)
    np.testing.assert_allclose(
        _material(asset.vertex_maps, ao=True)[0], 0.5 * _material(asset.vertex_maps, ao=False)[0]
    )
    np.testing.assert_allclose(_material(asset.vertex_maps, ao=False)[0], 0.5, atol=2e-3)


def test_roughness_stays_off_zero():
    asset = Asset(SPHERE, {"roughness": np.zeros((len(SPHERE.vertices), 1))})
    assert _material(asset.vertex_maps, ao=True)[1].min() == np.float32(0.05)


def test_displacement_moves_along_the_normals_by_the_squared_height():
    height = np.linspace(0, 1, len(SPHERE.vertices))[:, None]
    asset, split = Asset(SPHERE, {"height": height}), split_at_hard_edges(SPHERE)
    positions, _, detail = _surface(asset, split, SPHERE.normalised()[1], 0.1)
    np.testing.assert_allclose(np.linalg.norm(positions, axis=1), 1 + 0.1 * height[:, 0] ** 2, atol=1e-4)
    assert np.abs(detail - SPHERE.normals).max() > 0.01  # no normal map: relief from the surface itself


@pytest.mark.parametrize("bake", [False, True])
def test_displacement_beside_a_normal_map_keeps_the_normals(bake):
    """The map holds the relief already."""
    height, flat = np.linspace(0, 1, len(SPHERE.vertices))[:, None], bent(0.0, 0.0)
    asset = Asset(SPHERE, {**flat.vertex_maps, "height": height}, flat.tangents)
    if bake:
        asset = asset.baked(64)
    split = split_at_hard_edges(SPHERE) if asset.atlas is None else split_at_seams(SPHERE, asset.atlas.uv)
    plain, moved = (_surface(asset, split, SPHERE.normalised()[1], b) for b in (0.0, 0.1))
    assert np.abs(moved[0] - plain[0]).max() > 0.05
    np.testing.assert_array_equal(moved[2], plain[2])


def cube() -> Mesh:
    """Eight vertices, and the normals of the faces."""
    points = np.array([[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)], float)
    squares = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    mesh = Mesh(points, squares[:, [0, 1, 2, 0, 2, 3]].reshape(-1, 3))
    return replace(mesh, corner_normals=np.repeat(mesh.face_normals[:, None], 3, axis=1))


@pytest.mark.parametrize("bake", [False, True])
def test_hard_edges_look_as_if_the_vertices_were_split(bake):
    hard = cube()
    split = split_at_hard_edges(hard)
    apart = Mesh(hard.vertices[split.source], split.faces)
    images = []
    for mesh, source in (
        (hard, np.arange(8)),
        (apart, split.source),
        (replace(hard, corner_normals=None), None),
    ):
        albedo = 0.5 + 0.3 * hard.vertices[np.arange(8) if source is None else source]
        asset = Asset(mesh, {"albedo": albedo})
        if bake:
            layout = np.random.default_rng(0).random((12, 3, 2)).astype(np.float32)
            asset = asset.baked(64, layout=layout)
        images.append(picture(asset, azimuth=30, elevation=23))
    np.testing.assert_allclose(images[0], images[1], atol=1e-4)
    assert np.abs(images[0] - images[2]).max() > 0.05


def test_the_size_of_the_mesh_does_not_matter():
    big = SPHERE.with_vertices(100 * SPHERE.vertices + [7, 8, 9])
    images = [picture(Asset(mesh, GREY)) for mesh in (SPHERE, big)]
    np.testing.assert_allclose(images[0], images[1], atol=0.05)


def test_passes_add_up_to_the_same_picture(monkeypatch):
    renderer = OrbitRenderer(Asset(SPHERE, GREY), resolution=SIDE)
    view = renderer.fit_view(0.0, 17.0)
    once = renderer.render(0.0, view, 64)
    monkeypatch.setattr("mitex.render.renderer.SAMPLES_PER_PASS", SIDE * SIDE * 16)
    four = renderer.render(0.0, view, 64)
    assert np.abs(once - four).mean() < 0.02 and (once != four).any()


def test_seeds_make_the_noise():
    renderer = OrbitRenderer(Asset(SPHERE, GREY), resolution=SIDE)
    view = renderer.fit_view(0.0, 17.0)
    first, again, other = (renderer.render(0.0, view, 4, seed) for seed in (0, 0, 1))
    np.testing.assert_allclose(first, again, atol=1e-4)
    assert np.abs(first - other).max() > 1e-2


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"resolution": 8}, "pixels is not possible"),
        ({"resolution": 8000}, "pixels is not possible"),
        ({"displacement": 0.6}, "out of range"),
        ({"displacement": math.nan}, "out of range"),
        ({"displacement": 0.1}, "needs a height map"),
    ],
)
def test_wrong_options(options, message):
    with pytest.raises(ConfigError, match=message):
        OrbitRenderer(Asset(SPHERE, GREY), **options)


def test_wrong_views():
    asset = Asset(icosphere(1), {"albedo": np.zeros((12, 3))})
    renderer = OrbitRenderer(asset, resolution=16)
    for elevation in (-0.1, 85.1, math.nan):
        with pytest.raises(ConfigError, match="elevation"):
            renderer.fit_view(0.0, elevation)
    for spp in (0, 70000):
        with pytest.raises(ConfigError, match="samples per pixel"):
            renderer.render(0.0, renderer.fit_view(0.0), spp)
    OrbitRenderer(asset, resolution=16, floating=True).fit_view(0.0, -85.0)


@pytest.mark.parametrize("lean", [(0.0, 0.0), (0.5, 0.2), (-0.4, 0.4)])
def test_textures_look_like_the_vertex_maps_they_were_baked_from(lean):
    """Colour and relief, in mirrored charts too; Mitsuba darkens leaning normals of maps by some percent."""
    asset = bent(*lean)
    maps = {**asset.vertex_maps, "albedo": 0.3 + 0.5 * (SPHERE.vertices * 0.5 + 0.5)}
    asset = Asset(SPHERE, maps, asset.tangents)
    baked = asset.baked(256)
    a, b = picture(asset, spp=64), picture(baked, spp=64)
    inner = slice(7, 17)
    assert np.abs(a - b)[inner, inner].max() < 0.18 and np.abs(a - b)[inner, inner].mean() < 0.08


def test_a_texture_shows_what_no_vertex_holds():
    """The vertex maps are grey, the texture is red."""
    baked = Asset(icosphere(2), {"albedo": np.full((42, 3), 0.5)}).baked(64)
    assert baked.texture_maps is not None
    red_map = np.zeros((64, 64, 3), np.float32)
    red_map[:, :, 0] = 1.0
    image = picture(replace(baked, texture_maps={"albedo": red_map}))
    red, green, _ = middle(image)
    assert red > 5 * green


def test_meshes_of_any_size_share_their_kernels():
    """To make them takes far longer than a picture."""
    from mitex.runtime.jit import dr

    kernels = []
    for frequency in (4, 5):
        ball = icosphere(frequency)
        asset = Asset(ball, {"albedo": np.full((len(ball.vertices), 3), 0.5, np.float32)})
        with dr.scoped_set_flag(dr.JitFlag.KernelHistory):
            dr.kernel_history_clear()
            picture(asset, spp=1)
            large = {entry["hash"] for entry in dr.kernel_history() if entry.get("operation_count", 0) > 1000}
        kernels.append(large)
    assert kernels[0] == kernels[1] != set()
