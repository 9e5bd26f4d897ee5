"""The asset's checks, its baking, and the choice of formats."""

import os
from dataclasses import FrozenInstanceError

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.errors import ConfigError, MeshError, OutputError
from mitex.geometry.normal_maps import decode
from mitex.geometry.vectors import unit
from mitex.mesh import icosphere
from tests.export.common import wavy

MESH = icosphere(2)
GREY = {"albedo": np.full((42, 3), 0.5)}
NORMAL = {"normal": np.full((42, 3), 0.5)}


def test_values_are_clipped_float32():
    albedo = np.linspace(-0.1, 1.1, 126).reshape(42, 3)
    asset = Asset(MESH, {"albedo": albedo})
    np.testing.assert_array_equal(asset.vertex_maps["albedo"], np.clip(albedo, 0, 1).astype(np.float32))
    assert albedo.min() < 0  # the caller's array stays
    with pytest.raises(FrozenInstanceError):
        asset.name = "other"  # pyright: ignore[reportAttributeAccessIssue]


def test_nothing_of_an_asset_can_be_changed():
    """Neither through its own arrays, nor through those that it was made from."""
    east = np.tile(np.array([1, 0, 0], np.float32), (42, 1))
    maps = {"albedo": np.full((42, 3), 0.5, np.float32), **NORMAL}
    asset = Asset(MESH, maps, east).baked(32)
    assert asset.atlas is not None and asset.tangents is not None and asset.texture_maps is not None
    for array in (
        *(asset.tangents, *asset.vertex_maps.values(), *asset.texture_maps.values()),
        *(asset.atlas.uv, asset.atlas.face, asset.atlas.barycentric, asset.atlas.inside),
    ):
        with pytest.raises(ValueError, match="read-only"):
            array[0] = 0
    with pytest.raises(TypeError):
        asset.vertex_maps["albedo"] = maps["albedo"]  # pyright: ignore[reportIndexIssue]
    maps["albedo"][:] = east[:] = 0
    assert asset.vertex_maps["albedo"].min() == 0.5 and asset.tangents[:, 0].min() == 1


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"vertex_maps": {}}, "no maps"),
        ({"vertex_maps": {"colour": np.zeros((42, 3))}}, "'colour' is not a map"),
        ({"vertex_maps": {"albedo": np.zeros((42, 1))}}, "shape"),
        ({"vertex_maps": {"height": np.zeros(42)}}, "shape"),
        ({"vertex_maps": {"albedo": np.zeros((41, 3))}}, "shape"),
        ({"vertex_maps": {"albedo": np.full((42, 3), np.nan)}}, "NaN"),
        ({"vertex_maps": NORMAL}, "no tangents"),
        ({"vertex_maps": NORMAL, "tangents": np.zeros((42, 2))}, "tangents have shape"),
        ({"vertex_maps": NORMAL, "tangents": np.full((42, 3), np.inf)}, "tangents hold"),
        ({"vertex_maps": GREY, "texture_maps": {"albedo": np.zeros((64, 64, 3))}}, "belong together"),
    ],
)
def test_wrong_input(arguments, message):
    with pytest.raises(ConfigError, match=message):
        Asset(MESH, **arguments)


def test_textures_must_fit_the_atlas():
    baked = Asset(MESH, GREY).baked(64)
    with pytest.raises(ConfigError, match="texture map albedo has shape"):
        Asset(MESH, GREY, atlas=baked.atlas, texture_maps={"albedo": np.zeros((32, 32, 3))})
    with pytest.raises(ConfigError, match="another mesh"):
        Asset(icosphere(1), {"height": np.zeros((12, 1))}, atlas=baked.atlas, texture_maps={})


def test_without_a_normal_map_the_normals_are_those_of_the_mesh():
    np.testing.assert_array_equal(Asset(MESH, GREY).detail_normals(), MESH.normals)


def test_detail_normals_lean_along_the_tangents():
    # Everywhere 30 degrees from the normal towards east.
    east = unit(np.stack([MESH.vertices[:, 2], 0 * MESH.vertices[:, 0], -MESH.vertices[:, 0]], axis=1) + 1e-9)
    encoded = np.tile([0.5 + 0.25, 0.5, 0.5 + 0.25 * np.sqrt(3)], (42, 1))
    detail = Asset(MESH, {"normal": encoded}, east).detail_normals()
    poles = np.abs(MESH.vertices[:, 1]) > 0.99
    expected = np.cos(np.pi / 6) * MESH.normals + 0.5 * east
    np.testing.assert_allclose(detail[~poles], expected[~poles], atol=1e-3)


def test_baked_maps_interpolate_the_vertices():
    asset = wavy().baked(128)
    assert asset.atlas is not None and asset.texture_maps is not None
    atlas = asset.atlas
    assert set(asset.texture_maps) == set(asset.vertex_maps)
    for row, column in np.argwhere(atlas.inside)[::501]:
        corners = asset.mesh.faces[atlas.face[row, column]]
        expected = atlas.barycentric[row, column] @ asset.vertex_maps["albedo"][corners]
        np.testing.assert_allclose(asset.texture_maps["albedo"][row, column], expected, atol=1e-5)


def test_small_textures_have_less_padding():
    atlas = Asset(MESH, GREY).baked(32).atlas
    assert atlas is not None and atlas.resolution == 32
    with pytest.raises(ConfigError, match="padding"):
        Asset(MESH, GREY).baked(32, padding=8)


def test_baked_normals_decode_to_those_of_the_source():
    asset = wavy().baked(128)
    assert asset.atlas is not None and asset.texture_maps is not None
    atlas = asset.atlas
    normals = decode(asset.texture_maps["normal"], *atlas.shading_frames(asset.mesh))
    source = unit(atlas.interpolate(asset.detail_normals()[asset.mesh.faces]))
    assert (normals * source).sum(axis=2)[atlas.inside].min() > 1 - 1e-5
    np.testing.assert_array_equal(asset.texture_maps["normal"][atlas.face < 0][:1], [[0.5, 0.5, 1.0]])


@pytest.mark.parametrize("name", ["a.fbx", "a", "a.png"])
def test_unknown_formats(name, tmp_path):
    with pytest.raises(OutputError, match=r"use one of \.glb"):
        Asset(MESH, GREY).export(tmp_path / name)
    (tmp_path / name).write_bytes(b"x")
    with pytest.raises(MeshError, match="not an asset file"):
        Asset.load(tmp_path / name)


def test_upper_case_suffixes(tmp_path):
    assert len(Asset.load(Asset(MESH, GREY).export(tmp_path / "A.PLY")).mesh.faces) == len(MESH.faces)


@pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply", ".exr"])
def test_unwritable_places(suffix, tmp_path):
    asset = Asset(MESH, GREY).baked(64)
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError):
        asset.export(tmp_path / "file" / f"a{suffix}")
    (tmp_path / f"folder{suffix}").mkdir()
    with pytest.raises(OutputError, match="is a folder"):
        asset.export(tmp_path / f"folder{suffix}")


def test_missing_and_unreadable_files(tmp_path):
    with pytest.raises(MeshError, match="no asset file"):
        Asset.load(tmp_path / "a.glb")
    (tmp_path / "b.glb").mkdir()
    with pytest.raises(MeshError, match="no asset file"):
        Asset.load(tmp_path / "b.glb")
    if os.geteuid():
        (tmp_path / "c.glb").write_bytes(b"glTF")
        (tmp_path / "c.glb").chmod(0)
        with pytest.raises(MeshError, match="cannot be read"):
            Asset.load(tmp_path / "c.glb")
