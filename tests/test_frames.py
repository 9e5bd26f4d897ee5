"""Tangent frames against flat patches, spheres and a hand-made mirror."""

import numpy as np
import pytest

from mitex.frames import MIN_Z, decode, encode, orthonormal, split_at_seams, unit, vertex_detail
from mitex.mesh import Mesh, icosphere


def patch(mirrored: bool = False, turn: float = 0.0) -> Mesh:
    """The square [0, 1]^2 in the xy plane; u runs along x (or against it), turned by an angle."""
    points = np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]], np.float32)
    faces = np.array([[0, 1, 2], [0, 2, 3]])
    flat = points[faces][..., :2] - 0.5
    c, s = np.cos(turn), np.sin(turn)
    uv = flat @ np.array([[c, -s], [s, c]]) * ([-1, 1] if mirrored else [1, 1])
    return Mesh(points, faces, 0.5 + 0.5 * uv)


def random_frames(rng, count: int) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Unit but skewed, as interpolated ones are."""
    normal = unit(rng.normal(size=(count, 3)))
    tangent = orthonormal(rng.normal(size=(count, 3)), normal)
    skew = 0.1 * rng.normal(size=(2, count, 3))
    bitangent = np.cross(normal, tangent) * rng.choice([-1.0, 1.0], (count, 1))
    return unit(tangent + skew[0]), unit(bitangent + skew[1]), normal


def test_decode_inverts_encode(rng):
    frame = random_frames(rng, 500)
    detail = unit(unit(rng.normal(size=(500, 3))) + 1.6 * frame[2])
    encoded = encode(detail, *frame)
    assert encoded.min() >= 0 and encoded.max() <= 1
    np.testing.assert_allclose(decode(encoded, *frame), detail, atol=2e-6)


def test_eight_bits_cost_less_than_a_degree(rng):
    frame = random_frames(rng, 500)
    detail = unit(unit(rng.normal(size=(500, 3))) + 1.6 * frame[2])
    rounded = np.round(encode(detail, *frame) * 255) / 255
    cosine = (decode(rounded, *frame) * detail).sum(axis=1)
    assert np.degrees(np.arccos(cosine.min())) < 1.0


def test_normals_below_the_surface_are_lifted():
    x, y, z = np.eye(3)[:, None]
    encoded = encode(np.array([[1.0, 0.0, -1.0]]), x, y, z)
    assert 0.5 + 0.5 * 0.9 * MIN_Z < encoded[0, 2] < 0.5 + MIN_Z
    assert encoded[0, 0] > 0.99


def test_a_collapsed_frame_gives_the_even_normal():
    x, _, z = np.eye(3)[:, None]
    np.testing.assert_allclose(encode(z, x, x, z), [[0.5, 0.5, 1.0]], atol=0.03)


def test_orthonormal_survives_parallel_and_zero_tangents(rng):
    normals = unit(rng.normal(size=(20, 3)))
    for tangents in (normals.copy(), np.zeros_like(normals)):
        t = orthonormal(tangents, normals)
        np.testing.assert_allclose((t * normals).sum(axis=1), 0.0, atol=1e-6)
        np.testing.assert_allclose(np.linalg.norm(t, axis=1), 1.0, atol=1e-6)


def test_vertex_detail_leans_where_the_map_says():
    mesh = patch()
    east = np.tile([1.0, 0.0, 0.0], (4, 1))
    right, up = 0.5 + 0.5 * np.array([[0.6, 0.0, 0.8], [0.0, 0.6, 0.8]])
    np.testing.assert_allclose(vertex_detail(mesh, east, np.tile(right, (4, 1)))[0], [0.6, 0, 0.8], atol=1e-6)
    np.testing.assert_allclose(vertex_detail(mesh, east, np.tile(up, (4, 1)))[0], [0, 0.6, 0.8], atol=1e-6)


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
