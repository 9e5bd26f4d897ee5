"""What a mesh file refers to."""

import json

import pytest

from mitex.mesh.files import mesh_files

MATERIAL = """newmtl a
map_Kd colour.png
map_Bump -bm 0.5 my normal map.png
norm textures\\deep.png
# map_Kd remark.png
Kd 1 1 1
map_Pr missing.png
"""
TEXTURES = ("colour.png", "my normal map.png", "textures/deep.png", "remark.png", "1")


def _names(folder, file):
    return {str(path.relative_to(folder)) for path in mesh_files(folder / file)}


def test_obj_with_materials_and_textures(tmp_path):
    (tmp_path / "textures").mkdir()
    for name in TEXTURES:
        (tmp_path / name).touch()
    (tmp_path / "my material.mtl").write_text(MATERIAL)
    (tmp_path / "b.MTL").write_text("map_Kd b.mtl\nmap_Kd b.MTL\n")  # a circle
    (tmp_path / "a.obj").write_text("v 0 0 0\r\nmtllib my material.mtl\r\nmtllib b.MTL c.mtl\r\nf 1 1 1\r\n")
    textures = {"colour.png", "my normal map.png", "textures/deep.png"}
    assert _names(tmp_path, "a.obj") == {"a.obj", "my material.mtl", "b.MTL"} | textures


def test_gltf_with_buffers_and_images(tmp_path):
    for name in ("a.bin", "my image.png", "other.png"):
        (tmp_path / name).touch()
    images = [{"uri": "my%20image.png"}, {"uri": "data:image/png;base64,other.png"}, {"uri": "missing.png"}]
    tree = {"buffers": [{"uri": "a.bin"}], "images": images, "asset": {"generator": "other.png"}}
    (tmp_path / "a.gltf").write_text(json.dumps(tree))
    assert _names(tmp_path, "a.gltf") == {"a.gltf", "a.bin", "my image.png"}


def test_ply_with_a_texture(tmp_path):
    (tmp_path / "a.png").touch()
    (tmp_path / "a.ply").write_bytes(
        b"ply\nformat ascii 1.0\ncomment TextureFile a.png\nend_header\n\xff\xfe"
    )
    assert _names(tmp_path, "a.ply") == {"a.ply", "a.png"}


@pytest.mark.parametrize(
    "content", [b"", b"\xff\0\xfe", b'"uri": "\\ud800"', b'"uri": "a\\q"', b'"uri": "\0"']
)
@pytest.mark.parametrize("suffix", [".obj", ".gltf", ".ply", ".stl"])
def test_damaged_files_refer_to_nothing(tmp_path, content, suffix):
    file = tmp_path / f"a{suffix}"
    file.write_bytes(content)
    assert mesh_files(file) == [file]


@pytest.mark.parametrize("name", ["vase", "missing.obj", "folder", "/dev/zero", "a\0b", ""])
def test_what_is_no_file(tmp_path, monkeypatch, name):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "folder").mkdir()
    assert mesh_files(name) == []
