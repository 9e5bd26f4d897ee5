"""Several looks of one mesh in one GLB."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.errors import ConfigError, OutputError
from mitex.export import glb, write_variants
from mitex.mesh import icosphere
from tests.export.common import Glb, wavy
from tests.node import khronos_reports


@pytest.fixture(scope="module")
def looks() -> Any:
    """Two looks with all maps, and one without normals and roughness."""
    first = wavy(icosphere(6), name="waves").baked(64)
    textures = dict(first.texture_maps or {})
    darker = replace(first, name="dark", texture_maps=textures | {"albedo": 0.5 * textures["albedo"]})
    fewer = {name: textures[name] for name in ("albedo", "height")}
    vertices = {name: first.vertex_maps[name] for name in fewer}
    plain = replace(first, name="plain", vertex_maps=vertices, texture_maps=fewer)
    return [first, darker, plain]


def test_khronos_validator_finds_nothing(looks, tmp_path):
    paths = [write_variants(looks, tmp_path / "a.glb"), write_variants(looks[:1], tmp_path / "b.glb")]
    for report in khronos_reports(paths):
        assert [m for m in report["issues"]["messages"] if m["severity"] < 2] == [], json.dumps(report)


def test_each_variant_has_its_material(looks, tmp_path):
    file = Glb(write_variants(looks, tmp_path / "a.glb"))
    document, name = file.document, "KHR_materials_variants"
    assert document["extensionsUsed"] == [name]
    assert document["extensions"][name]["variants"] == [{"name": n} for n in ("waves", "dark", "plain")]
    mappings = file.primitive["extensions"][name]["mappings"]
    assert mappings == [{"material": k, "variants": [k]} for k in range(3)]
    assert len(document["meshes"]) == len(document["meshes"][0]["primitives"]) == 1
    for k, look in enumerate(looks):
        material = document["materials"][k]
        image = file.image(material["pbrMetallicRoughness"]["baseColorTexture"]) / 255.0
        assert np.abs(image - look.texture_maps["albedo"]).max() <= 0.5 / 255 + 1e-6
        assert ("normalTexture" in material) == ("normal" in look.texture_maps)
    assert file.primitive["material"] == 0 and "TANGENT" in file.primitive["attributes"]


def test_loading_gives_the_first_look(looks, tmp_path):
    loaded: Any = Asset.load(write_variants(looks[1:], tmp_path / "a.glb"))
    np.testing.assert_array_equal(loaded.mesh.vertices, looks[0].mesh.vertices)
    assert np.abs(loaded.texture_maps["albedo"] - looks[1].texture_maps["albedo"]).max() <= 0.5 / 255 + 1e-6


def test_looks_are_taken_one_at_a_time(looks, tmp_path, monkeypatch):
    """Only the first one, and the PNG files, are in memory; the file is written at the end."""
    encoded = []
    real = glb.png
    monkeypatch.setattr(glb, "png", lambda image: encoded.append(1) or real(image))

    def each():
        for k, look in enumerate(looks):
            assert len(encoded) == [0, 3, 6][k]
            yield look

    write_variants(each(), tmp_path / "a.glb")


def test_what_does_not_belong_together_is_refused(looks, tmp_path):
    first = looks[0]
    turned = replace(first, name="turned", atlas=replace(first.atlas, uv=first.atlas.uv[:, ::-1]))
    larger = replace(first, name="larger", mesh=first.mesh.with_vertices(2 * first.mesh.vertices))
    cases = [
        ([first, turned], "'turned' is on another mesh or UV layout than 'waves'"),
        ([first, larger], "'larger' is on another mesh"),
        ([first, replace(looks[1], name="waves")], "two variants 'waves'"),
        ([wavy(icosphere(6), name="bare")], "'bare' has no textures"),
        ([first, wavy(icosphere(6), name="bare")], "'bare' has no textures"),
        ([], "no variants"),
    ]
    for assets, message in cases:
        with pytest.raises(ConfigError, match=message):
            write_variants(assets, tmp_path / "a.glb")
    with pytest.raises(OutputError, match=r"use one of \.glb"):
        write_variants(looks, tmp_path / "a.obj")
    assert not list(tmp_path.iterdir())


def test_a_file_beyond_the_format_is_refused(looks, tmp_path, monkeypatch):
    monkeypatch.setattr(glb, "LARGEST", 50_000)
    with pytest.raises(OutputError, match="a GLB of .* GB is not possible; use fewer or smaller textures"):
        write_variants(looks, tmp_path / "a.glb")
    with pytest.raises(OutputError, match="GB"):
        looks[0].export(tmp_path / "a.glb")
    assert not list(tmp_path.iterdir())
