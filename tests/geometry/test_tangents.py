"""Tangents against flat patches, spheres and a hand-made mirror."""

import numpy as np
import pytest

from mitex.geometry.tangents import split_at_hard_edges, split_at_seams
from mitex.mesh import Mesh, icosphere


def patch(mirrored: bool = False, turn: float = 0.0) -> Mesh:
    """The square [0, 1]^2 in the xy plane; u runs along x (or against it), turned by an angle."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    flat = points[faces][..., :2] - 0.5
    c, s = np.cos(turn), np.sin(turn)
    uv = flat @ np.array([[c, -s], [s, c]]) * ([-1, 1] if mirrored else [1, 1])
    return Mesh(points, faces, 0.5 + 0.5 * uv)


@pytest.mark.parametrize("turn", [0.0, 0.7, 2.5])
def test_tangents_follow_u_and_bitangents_v(turn):
    mesh = patch(turn=turn)
    assert mesh.uv is not None
    split = split_at_seams(mesh, mesh.uv)
    assert len(split.source) == 4
    for p, q in zip(split.tangents, split.bitangents, strict=True):
        np.testing.assert_allclose(p, [np.cos(turn), np.sin(turn), 0.0, 1.0], atol=1e-6)
        np.testing.assert_allclose(q, [-np.sin(turn), np.cos(turn), 0.0], atol=1e-6)


def test_a_mirrored_layout_has_the_other_handedness():
    mesh = patch(mirrored=True)
    assert mesh.uv is not None
    split = split_at_seams(mesh, mesh.uv)
    np.testing.assert_allclose(split.tangents[0], [-1, 0, 0, -1], atol=1e-6)
    np.testing.assert_allclose(split.bitangents[0], [0, 1, 0], atol=1e-6)


def test_only_seams_split_vertices():
    mesh = patch()
    assert mesh.uv is not None
    uv = mesh.uv.copy()
    uv[1] += np.float32(0.01)
    split = split_at_seams(mesh, uv)
    assert len(split.source) == 6
    np.testing.assert_array_equal(split.source[split.faces], mesh.faces)
    np.testing.assert_array_equal(split.uv[split.faces], uv)


def test_neighbours_of_other_handedness_share_no_vertex():
    mesh = patch()
    assert mesh.uv is not None
    uv = mesh.uv.copy()
    uv[1, 2] = [1.0, 0.2]  # folds the second face over the first
    split = split_at_seams(mesh, uv)
    assert len(split.source) == 6
    assert set(split.tangents[split.faces[0], 3]) == {1.0} and set(split.tangents[split.faces[1], 3]) == {
        -1.0
    }


def test_normals_stay_smooth_across_seams():
    mesh = icosphere(4)
    uv = np.random.default_rng(0).random((len(mesh.faces), 3, 2)).astype(np.float32)  # every edge is a seam
    split = split_at_seams(mesh, uv)
    np.testing.assert_array_equal(split.normals, mesh.normals[split.source])
    np.testing.assert_allclose((split.normals * split.tangents[:, :3]).sum(axis=1), 0.0, atol=1e-5)


def test_hard_edges_split_vertices():
    mesh = icosphere(2)
    assert split_at_hard_edges(mesh).faces is mesh.faces
    flat = mesh.with_shading_normals(np.repeat(mesh.face_normals[:, None], 3, axis=1))
    split = split_at_hard_edges(flat)
    assert len(split.source) == 3 * len(mesh.faces) and (np.diff(split.source) >= 0).all()
    np.testing.assert_array_equal(split.source[split.faces], mesh.faces)
    np.testing.assert_array_equal(split.normals[split.faces], flat.corner_normals)
    # One face with normals of its own splits its three vertices only.
    normals = mesh.normals[mesh.faces]
    normals[5] = mesh.face_normals[5]
    split = split_at_hard_edges(mesh.with_shading_normals(normals))
    assert len(split.source) == len(mesh.vertices) + 3
    np.testing.assert_array_equal(split.normals[split.faces], normals)


def test_seams_and_hard_edges_split_together():
    mesh = patch()
    assert mesh.uv is not None
    normals = mesh.normals[mesh.faces]
    normals[1] = [0.6, 0.0, 0.8]
    uv = mesh.uv.copy()
    uv[1, 0] += np.float32(0.01)
    split = split_at_seams(mesh.with_shading_normals(normals), uv)
    assert len(split.source) == 6
    np.testing.assert_array_equal(split.normals[split.faces], normals)
    np.testing.assert_array_equal(split.uv[split.faces], uv)
    np.testing.assert_allclose((split.normals * split.tangents[:, :3]).sum(axis=1), 0.0, atol=1e-6)
