"""GLB: what other programs read, by the specification, by trimesh and by the Khronos validator."""

from functools import cache
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import trimesh

from mitex.asset import Asset
from mitex.colour import srgb_to_linear
from mitex.errors import MeshError
from mitex.export.glb import glb_bytes
from mitex.geometry.vectors import unit
from mitex.mesh import Mesh, icosphere
from tests.export.common import Glb, wavy
from tests.geometry.reference import mikktspace
from tests.node import khronos_reports


@pytest.fixture(scope="module")
def baked() -> Any:
    return wavy().baked(resolution=256)


def test_khronos_validator_finds_nothing(baked, tmp_path):
    flawed = Mesh(np.eye(4, 3, dtype=np.float32), np.array([[0, 1, 2], [0, 0, 1], [0, 2, 3]]), name="flawed")
    assets = {
        "baked": baked,
        "vertices": wavy(),
        "no_normal": wavy(without=("normal",)).baked(64),
        "only_roughness": Asset(icosphere(2), {"roughness": np.full((42, 1), 0.4)}).baked(64),
        "only_height": Asset(icosphere(2), {"height": np.full((42, 1), 0.4)}).baked(64),
        "degenerate": wavy(flawed).baked(64),
    }
    paths = [asset.export(tmp_path / f"{name}.glb") for name, asset in assets.items()]
    issues = {name: r["issues"]["messages"] for name, r in zip(assets, khronos_reports(paths), strict=True)}
    assert issues["baked"] == [] and issues["vertices"] == []
    # Severity 2 is information: an unused UV, a degenerate triangle that the mesh had before.
    serious = {name: [m for m in messages if m["severity"] < 2] for name, messages in issues.items()}
    assert serious == {name: [] for name in assets}


def test_trimesh_reads_positions_uvs_and_maps(baked, tmp_path):
    loaded: Any = trimesh.load(baked.export(tmp_path / "a.glb"), process=False, force="mesh")
    vertices = np.asarray(loaded.metadata.get("vertices", loaded.vertices), np.float32)
    np.testing.assert_array_equal(vertices[loaded.faces], baked.mesh.vertices[baked.mesh.faces])
    np.testing.assert_allclose(loaded.visual.uv[loaded.faces], baked.atlas.uv, atol=1e-6)
    material = loaded.visual.material
    for image, name in ((material.baseColorTexture, "albedo"), (material.normalTexture, "normal")):
        difference = np.asarray(image.convert("RGB")) / 255.0 - baked.texture_maps[name]
        assert np.abs(difference).max() <= 0.5 / 255 + 1e-6
    packed = np.asarray(material.metallicRoughnessTexture.convert("RGB")) / 255.0
    assert np.abs(packed[..., 1:2] - baked.texture_maps["roughness"]).max() <= 0.5 / 255 + 1e-6
    assert np.abs(packed[..., :1] - baked.texture_maps["ambient_occlusion"]).max() <= 0.5 / 255 + 1e-6
    assert not packed[..., 2].any()


def test_structure(baked, tmp_path):
    glb = Glb(baked.export(tmp_path / "a.glb"))
    attributes = {k: glb.attribute(k) for k in glb.primitive["attributes"]}
    count = len(attributes["POSITION"])
    assert {len(v) for v in attributes.values()} == {count}
    assert glb.faces.max() == count - 1 and glb.faces.shape == baked.mesh.faces.shape
    for name in ("NORMAL", "TANGENT"):
        np.testing.assert_allclose(np.linalg.norm(attributes[name][:, :3], axis=1), 1.0, atol=1e-5)
    assert set(np.unique(attributes["TANGENT"][:, 3])) <= {-1.0, 1.0}
    for view in glb.document["bufferViews"]:
        assert view["byteOffset"] % 4 == 0 and view["byteOffset"] + view["byteLength"] <= len(glb.blob)
    assert glb.material["doubleSided"]


def test_vertices_are_split_at_seams_only(baked, tmp_path):
    glb = Glb(baked.export(tmp_path / "a.glb"))
    flat = np.concatenate([baked.mesh.faces.reshape(-1, 1), baked.atlas.uv.reshape(-1, 2)], axis=1)
    assert len(glb.attribute("POSITION")) == len(np.unique(flat, axis=0))
    source = glb.attribute("_VERTEX")[:, 0].astype(int)
    np.testing.assert_array_equal(glb.attribute("NORMAL"), baked.mesh.normals[source])


def recomputed(glb: Glb, folder: Path) -> tuple[np.ndarray, np.ndarray]:
    """(F, 3, 3) tangents and (F, 3) signs, by a program that follows MikkTSpace and ignores TANGENT."""
    uv = glb.attribute("TEXCOORD_0")[glb.faces]
    corners = glb.attribute("POSITION")[glb.faces], glb.attribute("NORMAL")[glb.faces]
    return mikktspace(*corners, np.stack([uv[..., 0], 1.0 - uv[..., 1]], axis=2), folder)


@cache
def coarse() -> Asset:
    """Normals turn by 30 degrees from vertex to vertex, and tangents by more."""
    return wavy(icosphere(2)).baked(512)


def test_tangents_are_those_that_others_recompute(baked, tmp_path):
    for asset in (baked, coarse()):
        glb = Glb(asset.export(tmp_path / "a.glb"))
        tangents = glb.attribute("TANGENT")[glb.faces].astype(np.float64)
        vectors, signs = recomputed(glb, tmp_path)
        np.testing.assert_array_equal(tangents[..., 3], signs)
        cosine = (tangents[..., :3] * vectors).sum(axis=2).clip(-1, 1)
        assert np.degrees(np.arccos(np.quantile(cosine, 0.001))) < 0.5


@pytest.mark.parametrize("tangents", ["of the file", "recomputed"])
@pytest.mark.parametrize("make", [None, coarse])
def test_a_shader_decodes_the_source_normals(baked, tmp_path, tangents, make):
    """As MikkTSpace has it: bilinear map; tangent and normal interpolated, not normalised; bitangent from
    both in each pixel."""
    asset = make() if make else baked
    glb = Glb(asset.export(tmp_path / "a.glb"))
    vectors, signs = np.split(glb.attribute("TANGENT")[glb.faces], [3], axis=2)
    if tangents == "recomputed":
        vectors, signs = recomputed(glb, tmp_path)
    image = glb.image(glb.material["normalTexture"]) / 255.0
    rng = np.random.default_rng(3)
    face = rng.integers(len(glb.faces), size=3000)
    weight = rng.dirichlet([1, 1, 1], size=3000)

    def interpolate(corners):
        return np.einsum("nk,nkc->nc", weight, corners[face].astype(np.float64))

    x, y = interpolate(glb.attribute("TEXCOORD_0")[glb.faces]).T * len(image) - 0.5  # first row: v = 0
    j, i = np.floor(x).astype(int), np.floor(y).astype(int)
    a, b = (x - j)[:, None], (y - i)[:, None]
    top = image[i, j] * (1 - a) + image[i, j + 1] * a
    below = image[i + 1, j] * (1 - a) + image[i + 1, j + 1] * a
    n = 2 * (top * (1 - b) + below * b) - 1
    tangent, normal = interpolate(vectors), interpolate(glb.attribute("NORMAL")[glb.faces])
    bitangent = np.cross(normal, tangent) * signs[face, 0].reshape(-1, 1)
    pixels = unit(n[:, :1] * tangent + n[:, 1:2] * bitangent + n[:, 2:] * normal)
    source = unit(interpolate(asset.detail_normals()[asset.mesh.faces]))
    angle = np.degrees(np.arccos(np.clip((pixels * source).sum(axis=1), -1, 1)))
    # 256 texels a side are 4 an edge; 8 bits alone cost up to 0.5 degrees.
    assert angle.mean() < 0.2 and np.quantile(angle, 0.99) < 1.0 and angle.max() < 4.0
    # The map does something: without it the normals would be far off.
    assert np.degrees(np.arccos((unit(normal) * source).sum(axis=1))).mean() > 15


def test_unbaked_assets_have_linear_vertex_colours_and_detail_normals(tmp_path):
    asset = wavy()
    glb = Glb(asset.export(tmp_path / "a.glb"))
    np.testing.assert_allclose(
        glb.attribute("COLOR_0"), srgb_to_linear(asset.vertex_maps["albedo"]), atol=1e-6
    )
    np.testing.assert_array_equal(glb.attribute("POSITION"), asset.mesh.vertices)
    np.testing.assert_array_equal(glb.faces, asset.mesh.faces)
    np.testing.assert_allclose(glb.attribute("NORMAL"), asset.detail_normals(), atol=1e-6)
    assert "images" not in glb.document and glb.material["pbrMetallicRoughness"]["metallicFactor"] == 0


def test_what_is_missing_gets_a_factor(tmp_path):
    asset = Asset(icosphere(2), {"height": np.zeros((42, 1))}).baked(64)
    material = Glb(asset.export(tmp_path / "a.glb")).material
    assert material["pbrMetallicRoughness"]["roughnessFactor"] == 0.5
    assert material["pbrMetallicRoughness"]["baseColorFactor"][3] == 1.0


@pytest.mark.parametrize("bake", [False, True])
def test_loading_gives_the_asset_back(bake, baked, tmp_path):
    asset: Any = baked if bake else wavy()
    loaded: Any = Asset.load(asset.export(tmp_path / "a.glb"))
    assert loaded.name == asset.name and (loaded.texture_maps is not None) == bake
    np.testing.assert_array_equal(loaded.mesh.vertices, asset.mesh.vertices)
    np.testing.assert_array_equal(loaded.mesh.faces, asset.mesh.faces)
    for name in ("albedo", "ambient_occlusion", "height", "roughness"):
        np.testing.assert_allclose(
            loaded.vertex_maps[name], asset.vertex_maps[name], atol=0.012 if bake else 1e-6
        )
    cosine = (loaded.detail_normals() * asset.detail_normals()).sum(axis=1)
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 5.0
    if bake:
        np.testing.assert_allclose(loaded.atlas.uv, asset.atlas.uv, atol=1e-6)
        for name, image in asset.texture_maps.items():
            inside = asset.atlas.inside
            assert np.abs(loaded.texture_maps[name] - image)[inside].max() <= 0.5 / 255 + 1e-5


def test_unused_vertices_are_left_out(tmp_path):
    mesh = icosphere(3)
    more = Mesh(np.concatenate([[[9, 9, 9]], mesh.vertices]), mesh.faces + 1, name="more")
    loaded: Any = Asset.load(wavy(more).baked(64).export(tmp_path / "a.glb"))
    np.testing.assert_array_equal(loaded.mesh.vertices, mesh.vertices)
    np.testing.assert_array_equal(loaded.mesh.faces, mesh.faces)


@cache
def _valid() -> bytes:
    return glb_bytes(wavy(icosphere(2)).baked(64))


def _patched(data: bytes, old: bytes, new: bytes) -> bytes:
    assert old in data and len(old) == len(new)
    return data.replace(old, new)


@pytest.mark.parametrize(
    "damage",
    [
        pytest.param(lambda d: d[:-100], id="cut short"),
        pytest.param(lambda d: d[:15], id="header only"),
        pytest.param(lambda d: b"", id="empty"),
        pytest.param(lambda d: b"no GLB at all" * 9, id="text"),
        pytest.param(lambda d: _patched(d, b'"Mitex"', b'"Other"'), id="of another program"),
        pytest.param(lambda d: _patched(d, b'"type":"VEC3"', b'"type":"VEC4"'), id="wrong type"),
        pytest.param(lambda d: _patched(d, b'"byteOffset":0,', b'"byteOffset":-,'), id="broken JSON"),
        pytest.param(lambda d: _patched(d, b'"indices":', b'"indexes":'), id="no indices"),
        pytest.param(lambda d: _patched(d, b"IHDR", b"IXXX"), id="broken texture"),
    ],
)
def test_damaged_files(damage, tmp_path):
    path = tmp_path / "a.glb"
    path.write_bytes(damage(_valid()))
    with pytest.raises(MeshError, match=r"a\.glb"):
        Asset.load(path)


def test_face_indices_beyond_the_vertices_are_refused(tmp_path):
    path = wavy(icosphere(2)).export(tmp_path / "a.glb")
    data = bytearray(path.read_bytes())
    glb = Glb(path)
    view = glb.document["bufferViews"][glb.document["accessors"][glb.primitive["indices"]]["bufferView"]]
    start = len(data) - len(glb.blob) + view["byteOffset"]
    data[start : start + 4] = (4000).to_bytes(4, "little")
    path.write_bytes(data)
    with pytest.raises(MeshError):
        Asset.load(path)
