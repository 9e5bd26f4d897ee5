"""The atlas against point-in-triangle loops, linear functions and distances computed independently."""

from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from scipy.ndimage import distance_transform_edt

from mitex.atlas import Atlas, laid_out, spread, unwrap, usable_uv
from mitex.errors import ConfigError, MeshError
from mitex.mesh import Mesh, icosphere, subdivide_loop, torus


def square(columns: int = 3) -> Mesh:
    """A flat grid on [0, 1]^2 whose uv is (x, y) shrunk into [0.2, 0.8]^2."""
    x, y = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, columns + 1))
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], axis=1)
    a = (np.arange(columns)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns + 2
    faces = np.concatenate([np.stack([a, b, d], axis=1), np.stack([a, d, c], axis=1)])
    return Mesh(points, faces, 0.2 + 0.6 * points[faces][..., :2])


def texel_uv(resolution: int) -> np.ndarray:
    """(N, N, 2) uv of the texel centres, row 0 on top."""
    c = (np.arange(resolution) + 0.5) / resolution
    return np.stack(np.meshgrid(c, 1.0 - c), axis=-1)


def lookup(image: np.ndarray, uv: np.ndarray) -> np.ndarray:
    """Bilinear lookup as a viewer does it, one point after the other."""
    n = len(image)
    out = []
    for u, v in uv:
        x, y = u * n - 0.5, (1.0 - v) * n - 0.5
        i, j = int(np.floor(y)), int(np.floor(x))
        value = 0.0
        for di, wi in ((0, 1 - (y - i)), (1, y - i)):
            for dj, wj in ((0, 1 - (x - j)), (1, x - j)):
                value = value + wi * wj * image[np.clip(i + di, 0, n - 1), np.clip(j + dj, 0, n - 1)]
        out.append(value)
    return np.array(out)


def test_texels_inside_are_those_of_a_point_in_triangle_loop(rng):
    uv = rng.uniform(0.02, 0.98, (4, 3, 2)).astype(np.float32) * 0.5
    uv += np.array([[0, 0], [0.5, 0], [0, 0.5], [0.5, 0.5]], np.float32)[:, None]
    atlas = Atlas.from_uv(uv, 40, padding=2)
    expected = np.full((40, 40), -1)
    for k, (a, b, c) in enumerate(uv.astype(np.float64)):
        for (row, column), p in zip(np.ndindex(40, 40), texel_uv(40).reshape(-1, 2), strict=True):
            sides = [np.linalg.det(np.stack([q - p, r - p])) for q, r in ((a, b), (b, c), (c, a))]
            if min(sides) >= 0 or max(sides) <= 0:
                expected[row, column] = k
    assert (expected >= 0).sum() > 40
    np.testing.assert_array_equal(np.where(atlas.inside, atlas.face, -1), expected)


def test_each_texel_shows_the_point_with_its_own_uv():
    mesh = icosphere(8)
    uv = unwrap(mesh, 128, 4)
    atlas = Atlas.from_uv(uv, 128, 4)
    image = atlas.interpolate(uv)
    assert atlas.inside.sum() > 4000
    np.testing.assert_allclose(image[atlas.inside], texel_uv(128)[atlas.inside], atol=1e-5)
    np.testing.assert_allclose(atlas.barycentric[atlas.face >= 0].sum(axis=1), 1.0, atol=1e-5)
    assert atlas.barycentric[atlas.inside].min() > -1e-4


def test_linear_functions_are_looked_up_exactly_up_to_the_border():
    mesh = square()
    atlas = Atlas.build(mesh, 64, 4)
    image = atlas.interpolate(mesh.vertices[mesh.faces])
    edge = np.linspace(0, 1, 41)
    border = np.concatenate([np.stack([edge, e + 0 * edge], axis=1) for e in (0.0, 1.0)])
    points = np.concatenate([border, border[:, ::-1]])
    values = lookup(image, 0.2 + 0.6 * points)
    np.testing.assert_allclose(values[:, :2], points, atol=1e-4)


def test_row_0_is_the_top():
    mesh = square()
    image = Atlas.build(mesh, 64, 4).interpolate(mesh.vertices[mesh.faces])
    assert image[14, 32, 1] > 0.95  # y = 1
    assert image[49, 32, 1] < 0.05


def test_no_seam_shows_under_bilinear_lookup():
    mesh = icosphere(12)
    uv = unwrap(mesh, 256, 8)
    atlas = Atlas.from_uv(uv, 256, 8)
    image = atlas.interpolate(mesh.vertices[mesh.faces])
    corners, flat = mesh.faces.ravel(), uv.reshape(-1, 2)
    seam = np.array([len(np.unique(flat[corners == v], axis=0)) > 1 for v in range(len(mesh.vertices))])
    assert seam.sum() > 50
    on_seam = np.flatnonzero(seam[corners])
    values = lookup(image, flat[on_seam])
    texel = np.sqrt(4 * np.pi / atlas.inside.sum())  # [mesh units]
    # Every side of a seam finds the vertex where it is.
    assert np.abs(values - mesh.vertices[corners[on_seam]]).max() < 0.25 * texel


def test_padding_reaches_as_far_as_asked():
    uv = unwrap(icosphere(4), 128, 6)
    atlas = Atlas.from_uv(uv, 128, 6)
    away = np.asarray(distance_transform_edt(~atlas.inside))
    assert (atlas.face[away <= 6] >= 0).all()
    assert (atlas.face[away > 6 + 3] < 0).all()
    assert (atlas.face < 0).any()


def test_charts_do_not_bleed_into_each_other_in_the_first_mip_levels():
    # Two squares of other values, 8 texels of gap: each corner's value survives two levels of averaging.
    low = np.array([[[0.1, 0.1], [0.4, 0.1], [0.4, 0.9]], [[0.1, 0.1], [0.4, 0.9], [0.1, 0.9]]], np.float32)
    uv = np.concatenate([low, low + np.array([0.425, 0], np.float32)])
    values = np.repeat([0.0, 0.0, 1.0, 1.0], 3).reshape(4, 3, 1)
    image = Atlas.from_uv(uv, 320, 8).interpolate(values)
    for level in (0, 1, 2):
        if level:
            image = 0.25 * (image[::2, ::2] + image[1::2, ::2] + image[::2, 1::2] + image[1::2, 1::2])
        np.testing.assert_allclose(lookup(image, uv[:2].reshape(-1, 2)), 0.0, atol=1e-6)
        np.testing.assert_allclose(lookup(image, uv[2:].reshape(-1, 2)), 1.0, atol=1e-6)


def test_far_texels_hold_the_mean():
    mesh = square()
    image = Atlas.build(mesh, 64, 2).interpolate(mesh.vertices[mesh.faces])
    np.testing.assert_allclose(image[0, 0], [0.5, 0.5, 0.0], atol=0.02)


def test_own_uv_is_used_when_it_can_carry_a_map():
    mesh = square()
    assert mesh.uv is not None
    np.testing.assert_array_equal(Atlas.build(mesh, 64).uv, mesh.uv)


def _folded() -> np.ndarray:
    uv = square().uv
    assert uv is not None
    return np.abs(uv - 0.5) + 0.2


@pytest.mark.parametrize(
    "change",
    [
        pytest.param(lambda uv: uv + 0.5, id="outside"),
        pytest.param(lambda uv: uv * 0, id="a point"),
        pytest.param(lambda uv: uv * np.array([1, 0]), id="a line"),
        pytest.param(lambda uv: _folded(), id="folded over itself"),
        pytest.param(lambda uv: np.where(np.arange(len(uv))[:, None, None] < 2, 0.5, uv), id="part missing"),
    ],
)
def test_own_uv_is_replaced_when_it_cannot(change):
    mesh: Any = square()
    uv = change(mesh.uv).astype(np.float32)
    assert usable_uv(mesh, mesh.uv) and not usable_uv(mesh, uv)
    built = Atlas.build(Mesh(mesh.vertices, mesh.faces, uv), 64).uv
    assert usable_uv(mesh, built)


def test_unwrapping_leaves_nothing_out():
    mesh = icosphere(6)
    uv = unwrap(mesh, 256, 8)
    assert uv.shape == (len(mesh.faces), 3, 2) and uv.min() >= 0 and uv.max() <= 1
    assert usable_uv(mesh, uv)


def test_degenerate_faces_and_slivers_are_survived():
    points = [[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1e-6, 0], [5, 5, 5]]
    mesh = Mesh(np.array(points, np.float32), np.array([[0, 1, 2], [0, 0, 1], [0, 1, 3]]))
    atlas = Atlas.build(mesh, 64)
    assert np.isfinite(atlas.interpolate(mesh.vertices[mesh.faces])).all()
    assert (atlas.face[atlas.inside] == 0).any()


@pytest.mark.parametrize(("resolution", "padding"), [(8, 1), (9000, 8), (64, 0), (64, 9)])
def test_sizes_out_of_range(resolution, padding):
    with pytest.raises(ConfigError, match="out of range"):
        Atlas.build(square(), resolution, padding)


def test_layout_comes_before_subdivision():
    """Own UVs are kept where they are usable, and a layout survives the subdivision."""
    mesh = torus(8, 6)
    laid = laid_out(mesh, 128)
    assert laid.uv is not None and laid_out(laid, 128) is laid
    overlapping = replace(mesh, uv=np.zeros_like(laid.uv))
    for result in (laid_out(overlapping, 128), subdivide_loop(laid, 2)):
        assert result.uv is not None and usable_uv(result, result.uv)


def test_fine_smooth_meshes_are_unwrapped():
    """xatlas alone exhausts the stack here (its issue 146)."""
    sphere = icosphere(66)  # 87,120 faces
    uv = unwrap(sphere, 512, 2)
    assert usable_uv(sphere, uv)
    area = np.abs(np.linalg.det(uv[:, 1:].astype(float) - uv[:, :1]))
    stretch = np.sqrt(sphere.face_areas / area)
    assert np.ptp(np.percentile(stretch, [2, 98])) < 0.2 * np.median(stretch)


@pytest.mark.parametrize("scale", [1e-6, 1e6])
def test_unwrapping_does_not_depend_on_size(scale):
    mesh = torus(12, 8)
    mesh = mesh.with_vertices(scale * mesh.vertices)
    assert usable_uv(mesh, unwrap(mesh, 64, 2))


def test_spreading_continues_the_used_texels():
    rng = np.random.default_rng(3)
    used = np.zeros((20, 20), bool)
    used[6:9, 5:12] = True
    image = np.where(used[..., None], rng.random((20, 20, 2)), 7.0)
    result = spread(image, used, 3)
    assert np.array_equal(result[used], image[used])
    assert np.array_equal(result[4, 8], image[6, 8]) and np.array_equal(result[7, 2], image[7, 5])
    assert np.allclose(result[19, 19], image[used].mean(0)) and np.allclose(result[7, 1], image[used].mean(0))


@pytest.mark.parametrize(
    ("points", "faces"),
    [
        (np.eye(3), np.zeros((0, 3), np.int32)),
        (np.zeros((3, 3)), [[0, 1, 2]]),
        (np.outer([0, 1, 2], [1, 0, 0]), [[0, 1, 2]]),
    ],
)
def test_a_mesh_without_area_is_refused(points, faces):
    with pytest.raises(MeshError, match="flat has no area"):
        laid_out(Mesh(points, np.array(faces), name="flat"), 64)
