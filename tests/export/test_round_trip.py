"""An exported asset is the mesh that was read: vertices, order, polygons, hard edges, units, UVs."""

from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.geometry.vectors import orthonormal
from mitex.mesh import Mesh
from tests.export.common import Glb
from tests.geometry.reference import mikktspace
from tests.mesh.examples import exported_by_trimesh, gltf, octahedron
from tests.mesh.examples import glb_bytes as glb_of
from tests.mesh.solids import CUBE, SOLIDS, SQUARES, Solid


def dressed(mesh: Mesh, relief: bool = False) -> Asset:
    """Colours by position, and a normal map that is flat or leans."""
    lean = np.array([0.3, 0.2, 0.9]) if relief else np.array([0.0, 0.0, 1.0])
    normal = np.tile(0.5 + 0.5 * lean / np.linalg.norm(lean), (len(mesh.vertices), 1))
    albedo = 0.5 + 0.4 * np.sin(3 * mesh.vertices)
    tangents = orthonormal(np.tile(np.array([0.3, 0.1, 1.0], np.float32), (len(normal), 1)), mesh.normals)
    return Asset(mesh, {"albedo": albedo, "height": albedo[:, :1], "normal": normal}, tangents)


def loaded(solid: Solid, folder: Path) -> Mesh:
    path = folder / "source.obj"
    path.write_text(solid.obj())
    return Mesh.load(path)


def parsed(path: Path) -> Solid:
    """What an OBJ file says, by the letter."""
    words = [line.split() for line in path.read_text().splitlines()]
    pools = {k: np.array([w[1:] for w in words if w[0] == k], float) for k in ("v", "vt", "vn")}
    faces = [np.array([c.split("/") for c in w[1:]], int) - 1 for w in words if w[0] == "f"]
    uv, normals = [pools["vt"][f[:, 1]] for f in faces], [pools["vn"][f[:, 2]] for f in faces]
    return Solid(pools["v"], [f[:, 0].tolist() for f in faces], uv, normals)


def same(a: Mesh, b: Mesh) -> None:
    np.testing.assert_array_equal(a.vertices, b.vertices)
    np.testing.assert_array_equal(a.faces, b.faces)
    np.testing.assert_allclose(a.shading_normals, b.shading_normals, atol=1e-6)
    assert (a.corner_normals is None) == (b.corner_normals is None)


@pytest.mark.parametrize("name", list(SOLIDS))
def test_obj_is_the_file_that_was_read(name, tmp_path):
    solid = SOLIDS[name]
    mesh = loaded(solid, tmp_path)
    path = dressed(mesh).baked(64).export(tmp_path / "a.obj")
    result = parsed(path)
    np.testing.assert_array_equal(result.points.astype(np.float32), solid.points.astype(np.float32))
    assert result.polygons == solid.polygons
    for ours, theirs in zip(result.uv + result.normals, solid.uv + solid.normals, strict=True):
        np.testing.assert_allclose(ours, theirs, atol=1e-6)
    for again in (Mesh.load(path), Asset.load(path).mesh):
        same(again, mesh)
        np.testing.assert_array_equal(again.uv, mesh.uv)
        for ours, theirs in ((again.polygons, mesh.polygons),):
            assert ours is not None and theirs is not None
            np.testing.assert_array_equal(ours.sizes, theirs.sizes)
            np.testing.assert_array_equal(ours.triangles, theirs.triangles)


@pytest.mark.parametrize("name", list(SOLIDS))
@pytest.mark.parametrize("bake", [False, True])
def test_glb_is_the_mesh_that_was_read(name, bake, tmp_path):
    mesh = loaded(SOLIDS[name], tmp_path)
    asset: Any = dressed(mesh)
    path = (asset.baked(64) if bake else asset).export(tmp_path / "a.glb")
    glb = Glb(path)
    np.testing.assert_array_equal(glb.attribute("POSITION")[glb.faces], mesh.vertices[mesh.faces])
    np.testing.assert_allclose(glb.attribute("NORMAL")[glb.faces], mesh.shading_normals, atol=1e-6)
    if bake:
        assert mesh.uv is not None
        uv = glb.attribute("TEXCOORD_0")[glb.faces] * [1, -1] + [0, 1]
        np.testing.assert_allclose(uv, mesh.uv, atol=1e-6)
    else:
        same(Mesh.load(path), mesh)
    same(Asset.load(path).mesh, mesh)


@pytest.mark.parametrize("name", list(SOLIDS))
def test_ply_is_the_mesh_that_was_read(name, tmp_path):
    mesh = loaded(SOLIDS[name], tmp_path)
    asset = dressed(mesh, relief=True)
    path = asset.export(tmp_path / "a.ply")
    again = Asset.load(path)
    for ours in (again.mesh, Mesh.load(path)):
        same(ours, mesh)
        assert ours.polygons is not None and mesh.polygons is not None
        np.testing.assert_array_equal(ours.polygons.sizes, mesh.polygons.sizes)
        np.testing.assert_array_equal(ours.polygons.triangles, mesh.polygons.triangles)
        np.testing.assert_array_equal(ours.uv, mesh.uv)
    np.testing.assert_array_equal(again.vertex_maps["height"], asset.vertex_maps["height"])
    np.testing.assert_array_equal(again.tangents, asset.tangents)


def test_polygons_of_more_corners_than_a_byte_counts(tmp_path):
    corners = np.stack([np.cos(np.arange(300) / 48), np.sin(np.arange(300) / 48), np.zeros(300)], axis=1)
    text = "".join("v {} {} {}\n".format(*p) for p in corners.tolist())
    (tmp_path / "a.obj").write_text(text + f"f {' '.join(str(k + 1) for k in range(300))}\n")
    mesh = Mesh.load(tmp_path / "a.obj")
    again = Mesh.load(dressed(mesh).export(tmp_path / "a.ply"))
    assert again.polygons is not None and again.polygons.sizes.tolist() == [300]
    np.testing.assert_array_equal(again.faces, mesh.faces)


def test_a_flat_cube_stays_flat(tmp_path):
    mesh = loaded(SOLIDS["flat cube"], tmp_path)
    assert (len(mesh.vertices), len(mesh.faces)) == (8, 12)
    asset: Any = dressed(mesh).baked(64)
    glb = Glb(asset.export(tmp_path / "a.glb"))
    assert len(glb.attribute("POSITION")) == 24 and len(glb.faces) == 12
    flat = np.repeat(mesh.face_normals[:, None], 3, axis=1)
    np.testing.assert_allclose(glb.attribute("NORMAL")[glb.faces], flat, atol=1e-6)
    # The relief is none, so the map is flat: it does not draw the round surface over the edges.
    inside = asset.texture_maps["normal"][asset.atlas.inside]
    assert np.abs(inside - [0.5, 0.5, 1.0]).max() < 1e-3
    assert np.abs(Asset.load(tmp_path / "a.glb").vertex_maps["normal"] - [0.5, 0.5, 1.0]).max() < 5e-3


def test_units_and_place_stay(tmp_path):
    solid = SOLIDS["prism"]
    far = Solid(solid.points * 250.0 + [1000.0, -30.0, 7.0], solid.polygons, solid.uv, solid.normals)
    mesh = loaded(far, tmp_path)
    result = parsed(dressed(mesh).baked(64).export(tmp_path / "a.obj"))
    np.testing.assert_array_equal(result.points.astype(np.float32), far.points.astype(np.float32))


def test_an_stl_has_no_hard_edges(tmp_path):
    path = tmp_path / "a.stl"
    path.write_bytes(exported_by_trimesh(octahedron(), "stl"))
    mesh = Mesh.load(path)
    assert mesh.corner_normals is None and mesh.polygons is None
    result = parsed(dressed(mesh).baked(64).export(tmp_path / "a.obj"))
    np.testing.assert_array_equal(result.points.astype(np.float32), mesh.vertices)
    assert result.polygons == mesh.faces.tolist()
    np.testing.assert_allclose(np.stack(result.normals), mesh.normals[mesh.faces], atol=1e-6)


def split_cube(**more) -> bytes:
    """A glTF cube of 24 vertices, four to a side, in units and at a place of its node's."""
    points = np.array(CUBE, np.float32)[SQUARES].reshape(-1, 3)
    normals = np.repeat(np.array(CUBE, np.float32)[SQUARES].mean(axis=1), 4, axis=0)
    indices = (4 * np.arange(6)[:, None, None] + [[0, 1, 2], [0, 2, 3]]).reshape(-1, 3)
    part = {"positions": points, "normals": normals, "indices": indices}
    return glb_of(*gltf([part], [{"mesh": 0, **more}]))


def test_split_vertices_of_gltf_are_joined_and_split_again(tmp_path):
    path = tmp_path / "source.glb"
    path.write_bytes(split_cube())
    mesh = Mesh.load(path)
    assert len(mesh.vertices) == 8 and mesh.polygons is None
    flat = np.repeat(mesh.face_normals[:, None], 3, axis=1)
    np.testing.assert_allclose(mesh.shading_normals, flat, atol=1e-6)
    unbaked = Glb(dressed(mesh).export(tmp_path / "a.glb"))
    assert len(unbaked.attribute("POSITION")) == 24
    np.testing.assert_allclose(unbaked.attribute("NORMAL")[unbaked.faces], flat, atol=1e-6)
    # OBJ has normals of its own, so that its vertices are those of the joined mesh.
    assert len(parsed(dressed(mesh).baked(64).export(tmp_path / "a.obj")).points) == 8


def split_obj() -> Solid:
    """The flat cube with its vertices split at the edges, as game engines write it, in any order."""
    cube = SOLIDS["flat cube"]
    order = np.random.default_rng(1).permutation(24)
    points = np.empty((24, 3))
    points[order] = cube.points[np.concatenate(cube.polygons)]
    return Solid(points, order.reshape(6, 4).tolist(), cube.uv, cube.normals)


def test_vertices_that_an_obj_splits_are_written_as_they_were(tmp_path):
    solid = split_obj()
    mesh = loaded(solid, tmp_path)
    assert len(mesh.vertices) == 8
    path = dressed(mesh).baked(64).export(tmp_path / "a.obj")
    result = parsed(path)
    np.testing.assert_array_equal(result.points, solid.points)
    assert result.polygons == solid.polygons
    same(Mesh.load(path), mesh)
    # Mitex reads its own files as they are.
    assert len(Asset.load(path).mesh.vertices) == 24


def test_polygons_that_new_uvs_cut_are_written_as_triangles(tmp_path):
    mesh = loaded(SOLIDS["prism"], tmp_path)
    assert mesh.uv is not None and mesh.polygons is not None
    layout = mesh.uv.copy()
    layout[0] = layout[0][[1, 2, 0]]  # the first polygon's first triangle has a chart of its own
    result = parsed(dressed(mesh).baked(64, layout=layout).export(tmp_path / "a.obj"))
    assert [len(p) for p in result.polygons] == [3] * 5 + [4] * 7 + [7]
    expected = mesh.faces[:5].tolist() + SOLIDS["prism"].polygons[1:]
    assert result.polygons == expected
    again = Mesh.load(tmp_path / "a.obj")
    np.testing.assert_array_equal(again.faces, mesh.faces)
    np.testing.assert_array_equal(again.uv, layout)


@pytest.mark.parametrize("name", ["flat cube", "mirrored", "mixed", "prism"])
def test_tangents_at_hard_edges_are_those_that_others_recompute(name, tmp_path):
    mesh = loaded(SOLIDS[name], tmp_path)
    glb = Glb(dressed(mesh, relief=True).baked(64).export(tmp_path / "a.glb"))
    tangents = glb.attribute("TANGENT")[glb.faces].astype(np.float64)
    corners = glb.attribute("POSITION")[glb.faces], glb.attribute("NORMAL")[glb.faces]
    uv = glb.attribute("TEXCOORD_0")[glb.faces] * np.array([1, -1], np.float32) + np.array([0, 1], np.float32)
    vectors, signs = mikktspace(*corners, uv, tmp_path)
    np.testing.assert_array_equal(tangents[..., 3], signs)
    np.testing.assert_allclose(tangents[..., :3], vectors, atol=1e-3)
