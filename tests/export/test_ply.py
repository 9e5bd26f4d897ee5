"""PLY through trimesh and back."""

from typing import Any

import numpy as np
import pytest
import trimesh

from mitex.asset import Asset
from mitex.errors import MeshError
from mitex.mesh import icosphere
from tests.export.common import wavy


def test_trimesh_reads_positions_colours_and_floats(tmp_path):
    asset = wavy()
    loaded: Any = trimesh.load(asset.export(tmp_path / "a.ply"), process=False)
    np.testing.assert_array_equal(np.asarray(loaded.vertices, np.float32), asset.mesh.vertices)
    np.testing.assert_array_equal(loaded.faces, asset.mesh.faces)
    colours = loaded.visual.vertex_colors[:, :3] / 255.0
    assert np.abs(colours - asset.vertex_maps["albedo"]).max() <= 0.5 / 255 + 1e-6
    table = loaded.metadata["_ply_raw"]["vertex"]["data"]
    for name in ("height", "roughness", "ambient_occlusion"):
        np.testing.assert_array_equal(table[name].ravel(), asset.vertex_maps[name][:, 0])
    np.testing.assert_array_equal(table["normal_map_y"].ravel(), asset.vertex_maps["normal"][:, 1])


@pytest.mark.parametrize("without", [(), ("albedo",), ("albedo", "height", "normal", "roughness")])
def test_loading_gives_the_asset_back(without, tmp_path):
    asset = wavy(icosphere(3), without=without)
    loaded: Any = Asset.load(asset.export(tmp_path / "a.ply"))
    np.testing.assert_array_equal(loaded.mesh.vertices, asset.mesh.vertices)
    np.testing.assert_array_equal(loaded.mesh.faces, asset.mesh.faces)
    np.testing.assert_array_equal(loaded.tangents, asset.tangents)
    assert set(loaded.vertex_maps) == set(asset.vertex_maps)
    for name, values in asset.vertex_maps.items():
        tolerance = 0.5 / 255 + 1e-6 if name == "albedo" else 0
        np.testing.assert_allclose(loaded.vertex_maps[name], values, atol=tolerance, rtol=0)


@pytest.mark.parametrize(
    "damage",
    [
        pytest.param(lambda d: d[:-1], id="cut short"),
        pytest.param(lambda d: d + b"x", id="too long"),
        pytest.param(lambda d: b"", id="empty"),
        pytest.param(lambda d: d[:40], id="no end of the header"),
        pytest.param(lambda d: d.replace(b"\ncomment", b"end_header\n"), id="end in the second line"),
        pytest.param(lambda d: d.replace(b"Mitex", b"Other"), id="of another program"),
        pytest.param(lambda d: d.replace(b"property float x\n", b"property banana x\n"), id="unknown type"),
        pytest.param(lambda d: d.replace(b"property float x\n", b"property float w\n"), id="no x"),
        pytest.param(lambda d: d.replace(b"element vertex 42", b"element vertex -9"), id="negative count"),
        pytest.param(lambda d: d[:-4] + b"\xff\xff\x00\x00", id="index out of range"),
    ],
)
def test_damaged_files(damage, tmp_path):
    path = wavy(icosphere(2)).export(tmp_path / "a.ply")
    path.write_bytes(damage(path.read_bytes()))
    with pytest.raises(MeshError):
        Asset.load(path)


def test_a_ply_of_another_program_is_no_asset(tmp_path):
    trimesh.creation.box().export(tmp_path / "box.ply")
    with pytest.raises(MeshError, match="not written by Mitex"):
        Asset.load(tmp_path / "box.ply")
