"""OBJ with its material and maps, through trimesh and back."""

from typing import Any

import numpy as np
import pytest
import trimesh
from PIL import Image

from mitex.asset import Asset
from mitex.errors import MeshError, OutputError
from mitex.export import prepare_export
from mitex.mesh import icosphere
from tests.export.common import wavy, write_foreign


@pytest.fixture(scope="module")
def baked() -> Any:
    return wavy().baked(resolution=128)


def test_trimesh_reads_positions_uvs_and_colours(baked, tmp_path):
    loaded: Any = trimesh.load(baked.export(tmp_path / "a.obj"), process=False, force="mesh")
    np.testing.assert_array_equal(
        loaded.vertices.astype(np.float32)[loaded.faces], baked.mesh.vertices[baked.mesh.faces]
    )
    np.testing.assert_allclose(loaded.visual.uv[loaded.faces], baked.atlas.uv, atol=1e-7)
    albedo = np.asarray(loaded.visual.material.image.convert("RGB")) / 255.0
    assert np.abs(albedo - baked.texture_maps["albedo"]).max() <= 0.5 / 255 + 1e-6


def test_all_files_and_nothing_else(baked, tmp_path):
    baked.export(tmp_path / "a.obj")
    names = [f"a_{k}.png" for k in baked.texture_maps]
    assert sorted(p.name for p in tmp_path.iterdir()) == sorted(["a.mtl", "a.obj", *names])
    material = (tmp_path / "a.mtl").read_text()
    for line in (
        "map_Kd a_albedo.png",
        "norm a_normal.png",
        "map_Bump a_normal.png",
        "map_Pr a_roughness.png",
    ):
        assert f"\n{line}\n" in material


def test_maps_have_eight_bits(baked, tmp_path):
    baked.export(tmp_path / "a.obj")
    for name, image in baked.texture_maps.items():
        stored = np.asarray(Image.open(tmp_path / f"a_{name}.png"), np.float32).reshape(image.shape) / 255
        assert np.abs(stored - image).max() <= 0.5 / 255 + 1e-6


def test_names_with_spaces_work(baked, tmp_path):
    path = baked.export(tmp_path / "my best bunny.obj")
    assert (tmp_path / "my_best_bunny_albedo.png").is_file()
    assert np.abs(Asset.load(path).vertex_maps["albedo"] - baked.vertex_maps["albedo"]).max() < 0.02


def test_loading_gives_the_asset_back(baked, tmp_path):
    loaded: Any = Asset.load(baked.export(tmp_path / "a.obj"))
    np.testing.assert_array_equal(loaded.mesh.vertices, baked.mesh.vertices)
    np.testing.assert_array_equal(loaded.mesh.faces, baked.mesh.faces)
    np.testing.assert_array_equal(loaded.atlas.uv, baked.atlas.uv)
    for name in ("albedo", "ambient_occlusion", "height", "roughness"):
        np.testing.assert_allclose(loaded.vertex_maps[name], baked.vertex_maps[name], atol=0.02)
    cosine = (loaded.detail_normals() * baked.detail_normals()).sum(axis=1)
    # 128 texels a side are 2 an edge.
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 10.0


def test_unbaked_assets_are_baked(tmp_path, monkeypatch):
    small = Asset.baked
    monkeypatch.setattr(Asset, "baked", lambda self: small(self, 64))
    wavy(icosphere(3)).export(tmp_path / "a.obj")
    assert Image.open(tmp_path / "a_normal.png").size == (64, 64)


def test_all_or_nothing(baked, tmp_path, monkeypatch):
    def full(*_args, **_kwargs):
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(np, "savetxt", full)
    with pytest.raises(OutputError, match="no space left"):
        baked.export(tmp_path / "a.obj")
    assert list(tmp_path.iterdir()) == []


def _contents(folder):
    return {path.name: path.read_bytes() for path in folder.iterdir()}


@pytest.mark.parametrize("name", ["a.mtl", "a_albedo.png", "a_normal.png"])
@pytest.mark.parametrize("content", ["text", "image", "empty", "link"])
def test_files_beside_it_that_others_wrote_are_kept(baked, tmp_path, name, content):
    write_foreign(tmp_path / name, content, "newmtl Mitex\n" if content == "text" else "")
    before = {} if content == "link" else _contents(tmp_path)
    for write in (baked.export, prepare_export):
        with pytest.raises(OutputError, match=rf"'a.obj' comes with '.*{name}'.*; name another place"):
            write(tmp_path / "a.obj")
    assert content == "link" or _contents(tmp_path) == before


def test_files_of_ours_are_replaced(baked, tmp_path):
    baked.export(tmp_path / "a.obj")
    before = _contents(tmp_path)
    (tmp_path / "a_other.png").write_text("not ours, and in nobody's way")
    assert prepare_export(tmp_path / "a.obj") == tmp_path / "a.obj"
    baked.export(tmp_path / "a.obj")
    assert _contents(tmp_path) == before | {"a_other.png": b"not ours, and in nobody's way"}


def test_a_map_that_was_painted_over_is_kept(baked, tmp_path):
    baked.export(tmp_path / "a.obj")
    Image.open(tmp_path / "a_albedo.png").rotate(90).save(tmp_path / "a_albedo.png")  # drops the mark
    with pytest.raises(OutputError, match=r"a_albedo\.png"):
        baked.export(tmp_path / "a.obj")


def test_files_beside_it_may_be_inputs(baked, tmp_path):
    baked.export(tmp_path / "a.obj")
    (tmp_path / "guide.png").symlink_to("a_albedo.png")
    for source in ("a.mtl", "guide.png"):
        with pytest.raises(OutputError, match="is an input"):
            prepare_export(tmp_path / "a.obj", inputs=[tmp_path / source])
    assert prepare_export(tmp_path / "a.glb", inputs=[tmp_path / "a.mtl"]) == tmp_path / "a.glb"


@pytest.mark.parametrize(
    ("file", "old", "new", "message"),
    [
        ("a.obj", "# Mitex", "# Other", "not written by Mitex"),
        ("a.obj", "\nf 1/", "\nf x/", "damaged"),
        ("a.obj", "\nf ", "\nf 1/1 ", "damaged"),
        ("a.obj", "\nv ", "\nv nan ", "damaged"),
        ("a.mtl", "a_albedo.png", "../../etc/passwd", "outside"),
        ("a.mtl", "map_", "mop_", "a.obj"),
    ],
)
def test_damaged_files(baked, tmp_path, file, old, new, message):
    path = baked.export(tmp_path / "sub" / "a.obj")
    damaged = path.with_name(file)
    text = damaged.read_text()
    assert old in text
    damaged.write_text(text.replace(old, new, 1))
    if file == "a.mtl" and new == "mop_":
        path.with_name("a_normal.png").unlink()
    with pytest.raises(MeshError, match=message):
        Asset.load(path)


def test_indices_out_of_range_are_refused(baked, tmp_path):
    path = baked.export(tmp_path / "a.obj")
    text = path.read_text()
    for bad in ("f 999999/1/1 1/1/1 2/2/2\n", "f 1/999999/1 1/1/1 2/2/2\n", "f -999999/1/1 1/1/1 2/2/2\n"):
        path.write_text(text + bad)
        with pytest.raises(MeshError):
            Asset.load(path)


def test_a_file_cut_in_its_first_line(tmp_path):
    (tmp_path / "a.obj").write_text("# Mitex")
    with pytest.raises(MeshError, match="not written by Mitex"):
        Asset.load(tmp_path / "a.obj")


def test_a_missing_map_is_named(baked, tmp_path):
    path = baked.export(tmp_path / "a.obj")
    (tmp_path / "a_albedo.png").unlink()
    with pytest.raises(MeshError, match=r"a_albedo\.png"):
        Asset.load(path)
    (tmp_path / "a.mtl").unlink()
    with pytest.raises(MeshError, match=r"a\.mtl"):
        Asset.load(path)
