"""Folders: each map in a file of its own, read back, and never over files of others."""

from typing import Any

import numpy as np
import pytest
from PIL import Image

from mitex.asset import Asset
from mitex.colour import srgb_to_linear
from mitex.errors import OutputError
from mitex.exemplar import MAPS, Exemplar
from mitex.export import prepare_export, write_maps
from mitex.mesh import icosphere
from tests.export.common import read_exr, wavy, write_foreign


@pytest.fixture(scope="module")
def baked() -> Any:
    return wavy(icosphere(6)).baked(resolution=128)


def _contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir() if path.is_file()}


def test_a_folder_ends_with_a_slash_or_is_there(baked, tmp_path):
    names = sorted([*(f"{name}.png" for name in MAPS), "mesh.mtl", "mesh.obj"])
    (tmp_path / "there.v2").mkdir()
    for path in (f"{tmp_path}/new/deep/", tmp_path / "there.v2"):
        folder = baked.export(path)
        assert sorted(p.name for p in folder.iterdir()) == names
    with pytest.raises(OutputError, match="no suffix"):
        baked.export(tmp_path / "other")
    (tmp_path / "folder.glb").mkdir()
    with pytest.raises(OutputError, match="is a folder"):
        baked.export(tmp_path / "folder.glb")


def test_exemplars_and_assets_are_read_back(baked, tmp_path):
    folder = baked.export(f"{tmp_path}/maps/")
    exemplar = Exemplar.load(folder)
    assert set(exemplar.maps) == set(baked.texture_maps)
    for name, image in baked.texture_maps.items():
        step = 65535 if name == "height" else 255
        assert np.abs(exemplar.maps[name] - image).max() <= 0.5 / step + 1e-6
    loaded: Any = Asset.load(folder / "mesh.obj")
    np.testing.assert_array_equal(loaded.mesh.vertices, baked.mesh.vertices)
    np.testing.assert_array_equal(loaded.atlas.uv, baked.atlas.uv)
    assert np.abs(loaded.vertex_maps["albedo"] - baked.vertex_maps["albedo"]).max() < 0.03


def test_depths(baked, tmp_path):
    folder = baked.export(f"{tmp_path}/maps/")
    modes = {name: Image.open(folder / f"{name}.png").mode for name in MAPS}
    assert modes == {
        **{"albedo": "RGB", "normal": "RGB", "height": "I;16"},
        **{"roughness": "L", "ambient_occlusion": "L"},
    }


def test_exr(baked, tmp_path):
    folder = baked.export(f"{tmp_path}/maps/", maps_format="exr")
    assert not list(folder.glob("*.png")) and "map_Kd albedo.exr" in (folder / "mesh.mtl").read_text()
    maps = baked.texture_maps
    for name, depth in MAPS.items():
        channels = read_exr(folder / f"{name}.exr")
        assert list(channels) == (["Y"] if depth == 1 else ["B", "G", "R"])
        assert {v.dtype for v in channels.values()} == {np.dtype("f4" if name == "height" else "f2")}
        expected = srgb_to_linear(maps[name]) if name == "albedo" else maps[name]
        np.testing.assert_allclose(channels["Y" if depth == 1 else "G"], expected[..., depth // 2], atol=1e-3)


def test_unbaked_assets_are_baked(baked, tmp_path, monkeypatch):
    monkeypatch.setattr(Asset, "baked", lambda self: baked)
    folder = wavy(icosphere(6)).export(f"{tmp_path}/maps/")
    assert Image.open(folder / "albedo.png").size == (128, 128)


def test_only_maps_that_there_are(tmp_path):
    asset = Asset(icosphere(2), {"roughness": np.full((42, 1), 0.4)}).baked(64)
    folder = asset.export(f"{tmp_path}/maps/")
    assert sorted(p.name for p in folder.iterdir()) == ["mesh.mtl", "mesh.obj", "roughness.png"]
    (folder / "albedo.png").write_text("of somebody else, and in nobody's way")
    asset.export(folder)


@pytest.mark.parametrize("name", ["albedo.png", "height.exr", "mesh.obj", "mesh.mtl"])
@pytest.mark.parametrize("content", ["text", "image", "link"])
def test_files_of_others_are_kept(baked, tmp_path, name, content):
    write_foreign(tmp_path / name, content, "v 0 0 0\n")
    before = _contents(tmp_path)
    kind: Any = "exr" if name.endswith(".exr") else "png"
    for write in (baked.export, prepare_export):
        with pytest.raises(OutputError, match=f"{name}'.* that Mitex did not write; name another place"):
            write(tmp_path, maps_format=kind)
    assert _contents(tmp_path) == before


@pytest.mark.parametrize("kind", ["png", "exr"])
def test_files_of_ours_are_replaced(baked, tmp_path, kind):
    baked.export(tmp_path, kind)
    before = _contents(tmp_path)
    (tmp_path / "notes.txt").write_text("not ours")
    assert prepare_export(tmp_path, maps_format=kind) == tmp_path
    baked.export(tmp_path, kind)
    assert _contents(tmp_path) == before | {"notes.txt": b"not ours"}


def test_inputs_are_kept(baked, tmp_path):
    baked.export(tmp_path)
    for name in ("mesh.obj", "normal.png"):
        with pytest.raises(OutputError, match="is an input"):
            prepare_export(tmp_path, inputs=[tmp_path / name])


def test_checking_makes_nothing(tmp_path):
    assert prepare_export(f"{tmp_path}/new/maps/") == tmp_path / "new" / "maps"
    assert not list(tmp_path.iterdir())
    (tmp_path / "file").write_text("")
    with pytest.raises(OutputError, match="is a file"):
        prepare_export(f"{tmp_path}/file/")


def test_all_or_nothing(baked, tmp_path, monkeypatch):
    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savetxt", full)
    with pytest.raises(OutputError, match="no space left"):
        baked.export(f"{tmp_path}/maps/")
    assert not list(tmp_path.iterdir())


def test_maps_alone(baked, tmp_path):
    folder = write_maps(baked.texture_maps, tmp_path / "tile")
    assert sorted(p.name for p in folder.iterdir()) == sorted(f"{name}.png" for name in MAPS)
    (folder / "mesh.obj").write_text("of somebody else, and in nobody's way")
    write_maps(baked.texture_maps, folder)
