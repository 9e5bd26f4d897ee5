"""Texels against clipped polygons, sampled edges and loops over texels."""

from dataclasses import replace

import numpy as np
import pytest

from mitex import texels as module
from mitex.atlas import unwrap
from mitex.errors import ConfigError, MeshError
from mitex.mesh import Mesh, grid, icosphere
from mitex.texels import Texels, charts

SQUARE = np.array([[[0, 0], [1, 0], [1, 1]], [[0, 0], [1, 1], [0, 1]]], np.float32)


def flat(uv: np.ndarray, scale: float = 1.0) -> Mesh:
    """Separate triangles (F, 3, 2) in the xy plane, as large as in the layout times `scale`."""
    points = np.concatenate([scale * uv, 0 * uv[..., :1]], axis=2).reshape(-1, 3)
    return Mesh(points, np.arange(len(points)).reshape(-1, 3), uv)


def rasterize(uv: np.ndarray, resolution: int) -> Texels:
    return Texels.rasterize(flat(uv), uv, resolution)


def centre(index: int, resolution: int) -> np.ndarray:
    row, column = divmod(int(index), resolution)
    return np.array([(column + 0.5) / resolution, 1.0 - (row + 0.5) / resolution])


def clipped(triangle: np.ndarray, low: np.ndarray, high: np.ndarray) -> list[np.ndarray]:
    """The polygon that a box leaves of a triangle (Sutherland and Hodgman)."""
    polygon = list(triangle.astype(np.float64))
    for axis, bound, sign in ((0, low[0], 1), (0, high[0], -1), (1, low[1], 1), (1, high[1], -1)):
        result = []
        for p, q in zip(polygon, polygon[1:] + polygon[:1], strict=True):
            a, b = sign * (p[axis] - bound), sign * (q[axis] - bound)
            if a >= 0:
                result.append(p)
            if a * b < 0:
                result.append(p + (q - p) * (a / (a - b)))
        polygon = result
    return polygon


def contains(triangle: np.ndarray, point: np.ndarray) -> bool:
    a, b, c = triangle.astype(np.float64) - point
    sides = [p[0] * q[1] - p[1] * q[0] for p, q in ((a, b), (b, c), (c, a))]
    return min(sides) >= 0 or max(sides) <= 0


def border_distance(triangle: np.ndarray, point: np.ndarray) -> float:
    t = np.linspace(0, 1, 4001)[:, None]
    ends = zip(triangle.astype(np.float64), np.roll(triangle, -1, axis=0).astype(np.float64), strict=True)
    return min(np.linalg.norm(p + t * (q - p) - point, axis=1).min() for p, q in ends)


@pytest.fixture(scope="module")
def scattered() -> np.ndarray:
    """Triangles of both orientations, some of them slivers, some over the border, one less than a texel."""
    rng = np.random.default_rng(3)
    uv = rng.uniform(0, 0.45, (8, 3, 2)) + rng.uniform(0, 0.55, (8, 1, 2))
    uv[5, 2] = uv[5, :2].mean(axis=0) + 1e-4
    uv[6] = 0.031 + 0.01 * rng.uniform(0, 1, (3, 2))
    uv[7, 0] = (1.0, 0.0)
    return uv.astype(np.float32)


def test_a_texel_is_used_where_clipping_leaves_something_of_a_face(scattered):
    n = 17
    texels = rasterize(scattered, n)
    used = []
    for index in range(n * n):
        c = centre(index, n)
        faces = [k for k, t in enumerate(scattered) if clipped(t, c - 0.5 / n, c + 0.5 / n)]
        if not faces:
            continue
        k = len(used)
        used.append(index)
        around = [f for f in faces if contains(scattered[f], c)]
        assert texels.inside[k] == bool(around)
        if around:
            assert texels.face[k] == around[0]
        else:
            nearest = [border_distance(scattered[f], c) for f in faces]
            assert nearest[faces.index(texels.face[k])] < min(nearest) + 1e-4 / n
    np.testing.assert_array_equal(texels.index, used)
    assert 0.2 * n * n < len(used) < 0.8 * n * n
    assert texels.inside.any() and not texels.inside.all()


def test_border_texels_show_the_nearest_point_of_their_face(scattered):
    texels = rasterize(scattered, 29)
    assert texels.barycentric.min() >= 0.0
    np.testing.assert_allclose(texels.barycentric.sum(axis=1), 1.0, rtol=0, atol=1e-14)
    points = np.einsum("nk,nkc->nc", texels.barycentric, scattered[texels.face].astype(np.float64))
    centres = np.array([centre(i, 29) for i in texels.index])
    away = np.linalg.norm(points - centres, axis=1)
    assert away[texels.inside].max() < 1e-9
    border = np.flatnonzero(~texels.inside)
    expected = [border_distance(scattered[texels.face[k]], centres[k]) for k in border]
    # Sampling overestimates, by at most h^2 / 2d for a distance d and samples h apart.
    np.testing.assert_allclose(away[border], expected, rtol=0, atol=1e-5)
    assert (away[border] <= np.array(expected) + 1e-12).all()
    between = (texels.barycentric[border] > 1e-3).sum(axis=1)
    assert (between == 1).any() and (between == 2).sum() > 20  # corners and edges


def test_positions_reproduce_a_linear_function():
    mesh = grid(3, 3)
    low, side = 0.2925, 0.4375  # the texels along all four borders have their centres outside
    assert mesh.uv is not None
    uv = low + side * mesh.uv
    texels = Texels.rasterize(mesh, uv, 40)
    centres = np.array([centre(i, 40) for i in texels.index])
    expected = 2.0 * (np.clip(centres, low, low + side) - low) / side - 1.0
    np.testing.assert_allclose(texels.position[:, :2], expected, atol=1e-6)
    assert np.ptp(texels.position[:, :2], axis=0) == pytest.approx([2.0, 2.0])
    top = texels.position[texels.index < texels.index[0] + 20, 1]
    assert top.min() > 0.9  # row 0 is the top


@pytest.mark.parametrize("resolution", [1, 2, 5, 16])
def test_a_layout_that_fills_the_map_uses_every_texel(resolution):
    texels = rasterize(SQUARE, resolution)
    np.testing.assert_array_equal(texels.index, np.arange(resolution**2))
    assert texels.inside.all()  # also the centres on the diagonal
    assert texels.face.dtype == texels.index.dtype == texels.chart.dtype == np.int32


def test_texels_that_are_only_touched_count():
    texels = rasterize(0.25 + 0.5 * SQUARE, 8)
    rows, columns = np.divmod(texels.index, 8)
    assert (rows.min(), rows.max(), columns.min(), columns.max()) == (1, 6, 1, 6)
    assert len(texels.index) == 36 and texels.inside.sum() == 16


def test_one_texel_shows_the_centre_or_what_is_nearest_to_it():
    assert rasterize(SQUARE, 1).position[0] == pytest.approx([0.5, 0.5, 0.0])
    corner = rasterize(0.125 * SQUARE, 1)
    assert corner.position[0] == pytest.approx([0.125, 0.125, 0.0])
    texel, weight = corner.bilinear(np.array([0]), np.array([[1.0, 0.0, 0.0]]))
    assert texel.tolist() == [[0, 0, 0, 0]] and weight.sum() == 1.0


def test_nothing_depends_on_how_the_work_is_cut(scattered, monkeypatch):
    uv = np.concatenate([scattered, scattered[:3]])  # ties: the first of equal faces wins
    whole = rasterize(uv, 33)
    assert whole.face.max() < len(scattered)
    face, barycentric = np.repeat(whole.face, 2), np.repeat(whole.barycentric, 2, axis=0)
    looked_up = whole.bilinear(face, barycentric)
    monkeypatch.setattr(module, "CHUNK", 7)
    cut = rasterize(uv, 33)
    for name in ("index", "face", "barycentric", "position", "inside"):
        np.testing.assert_array_equal(getattr(cut, name), getattr(whole, name))
    for a, b in zip(cut.bilinear(face, barycentric), looked_up, strict=True):
        np.testing.assert_array_equal(a, b)


@pytest.mark.parametrize("scale", [1e-6, 3.0, 1e6])
def test_the_size_of_a_texel_is_the_median_over_the_faces(scale):
    uv = np.concatenate([0.5 * SQUARE, 0.5 + 0.25 * SQUARE[:1], 0.9 + 0 * SQUARE[:1], 0.8 + 0.1 * SQUARE[:1]])
    mesh = flat(uv, scale)
    vertices = mesh.vertices.copy()
    vertices[6:9] *= 4.0  # the third face is larger than in the layout, the fourth is a point there,
    vertices[12:] = vertices[12]  # and the fifth is one in space
    texels = Texels.rasterize(mesh.with_vertices(vertices), uv, 50)
    assert texels.size == pytest.approx(scale / 50, rel=1e-5)


def test_charts_end_where_uvs_differ():
    corners = np.array([[0, 1, 2], [0, 2, 3]])
    mesh = Mesh(np.array([[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]), corners)
    apart, hinged = 0.4 * SQUARE, 0.4 * SQUARE
    apart[1] += 0.5
    hinged[1, 1] += 0.01
    assert charts(mesh, SQUARE).tolist() == [0, 0]
    assert charts(mesh, apart).tolist() == [0, 1]
    assert charts(mesh, hinged).tolist() == [0, 1]  # one end of the edge agrees


def test_sides_without_a_length_join_nothing():
    uv = np.concatenate(
        [0.3 * SQUARE[:1], 0.4 + 0 * SQUARE[:1], 0.6 + 0.3 * SQUARE[:1], 0.5 + 0 * SQUARE[:1]]
    )
    uv[3, 0] = 0.55
    assert charts(flat(uv), uv).tolist() == [0, 1, 2, 3]


def test_charts_join_at_equal_places_and_only_along_edges():
    assert charts(flat(SQUARE), SQUARE).tolist() == [0, 0]  # six vertices at four places
    minus = np.where(SQUARE == 0, -SQUARE, SQUARE)
    assert charts(flat(np.stack([SQUARE[0], minus[1]])), SQUARE).tolist() == [0, 0]  # -0.0 is 0.0
    bow_tie = np.array([[[0, 0], [0.5, 0.5], [0, 1]], [[1, 0], [1, 1], [0.5, 0.5]]], np.float32)
    assert charts(flat(bow_tie), bow_tie).tolist() == [0, 1]
    mesh = icosphere(6)
    numbers = charts(mesh, unwrap(mesh, 64, 2))
    assert 1 < numbers.max() + 1 < 60
    assert (np.diff(np.unique(numbers, return_index=True)[1]) > 0).all()  # numbered by first face


def slow_bilinear(texels: Texels, face: int, barycentric: np.ndarray) -> dict[int, float]:
    n = texels.resolution
    u, v = barycentric @ texels.uv[face]
    x, y = u * n - 0.5, (1.0 - v) * n - 0.5
    weights = {}
    for k, index in enumerate(texels.index):
        row, column = divmod(int(index), n)
        weight = max(1 - abs(x - column), 0) * max(1 - abs(y - row), 0)
        if weight > 0 and texels.chart[texels.face[k]] == texels.chart[face]:
            weights[k] = weight
    total = sum(weights.values())
    return {k: weight / total for k, weight in weights.items()}


def read(texel: np.ndarray, weight: np.ndarray) -> dict[int, float]:
    return {int(k): float(w) for k, w in zip(texel, weight, strict=True) if w > 0}


def test_bilinear_weights_are_those_of_a_loop_over_all_texels(rng):
    # Two charts of three quarters of the map's height, one texel apart.
    left = np.array([0.37, 0.8]) * SQUARE + 0.1
    uv = np.concatenate([left, left + [0.37 + 1 / 16, 0]]).astype(np.float32)
    mesh = flat(np.concatenate([SQUARE, SQUARE + [2, 0]]).astype(np.float32))
    texels = Texels.rasterize(mesh, uv, 16)
    assert texels.chart.tolist() == [0, 0, 1, 1]
    face = rng.integers(0, 4, 400)
    barycentric = rng.dirichlet([0.4] * 3, 400)
    barycentric[:12] = np.tile(np.eye(3), (4, 1))
    texel, weight = texels.bilinear(face, barycentric)
    assert texel.dtype == np.int32 and weight.dtype == np.float32
    for k in range(400):
        assert read(texel[k], weight[k]) == pytest.approx(
            slow_bilinear(texels, face[k], barycentric[k]), abs=1e-5
        )
    np.testing.assert_allclose(weight.sum(axis=1), 1.0, atol=1e-6)
    crossing = texels.chart[texels.face[texel]] != texels.chart[face][:, None]
    assert not weight[crossing].any()
    assert (weight == 0).sum() > 20


def test_a_point_on_a_texel_centre_reads_that_texel_alone():
    mesh = icosphere(8)
    texels = Texels.rasterize(mesh, unwrap(mesh, 128, 4), 128)
    inside = np.flatnonzero(texels.inside)
    texel, weight = texels.bilinear(texels.face[inside], texels.barycentric[inside])
    assert ((weight > 0).sum(axis=1) == 1).all() and (weight.max(axis=1) == 1).all()
    np.testing.assert_array_equal(texel[np.arange(len(inside)), weight.argmax(axis=1)], inside)


def test_bilinear_reproduces_a_linear_function_away_from_the_border(rng):
    mesh = grid(2, 2)
    assert mesh.uv is not None
    texels = Texels.rasterize(mesh, 0.1 + 0.8 * mesh.uv, 32)
    face, barycentric = rng.integers(0, 8, 200), rng.dirichlet([1.0] * 3, 200)
    points = np.einsum("mk,mkc->mc", barycentric, mesh.vertices[mesh.faces[face]])
    texel, weight = texels.bilinear(face, barycentric)
    read = np.einsum("mk,mkc->mc", weight, texels.position[texel])
    inner = np.abs(points).max(axis=1) < 0.92
    assert inner.sum() > 100
    np.testing.assert_allclose(read[inner], points[inner], atol=1e-6)


def lost_layout() -> Texels:
    """Chart 0 holds the texels (8 x 8); of the others only chart 2 has some, but none at its far end."""
    big = 0.125 * np.array([[[2.2, 0], [8, 0], [8, 8]], [[2.2, 0], [8, 8], [2.2, 8]]])
    speck = 0.125 * np.array([[[4.1, 4.1], [4.2, 4.1], [4.1, 4.2]]])  # in a texel whose centre chart 0 has
    spike = 0.125 * np.array([[[0.5, 0.2], [7.9, 4.6], [0.5, 0.8]]])  # from the free columns far into chart 0
    point = np.tile(np.array([0.99, 0.01]), (1, 3, 1))
    uv = np.concatenate([big, speck, spike, point]).astype(np.float32)
    places = np.concatenate([big, speck + 3, spike + 6, np.array([[[9, 9], [10, 9], [9, 10]]])]).astype(
        np.float32
    )
    return Texels.rasterize(flat(places), uv, 8)


def test_points_without_a_texel_of_their_chart_read_the_nearest_that_is_left():
    texels = lost_layout()
    assert texels.chart.tolist() == [0, 0, 1, 2, 3]
    owned = [np.flatnonzero(texels.chart[texels.face] == c) for c in range(4)]
    assert len(owned[0]) == 48 and not len(owned[1]) and len(owned[2]) and not len(owned[3])
    thirds, tip = np.full((1, 3), 1 / 3), np.array([[0.0, 1.0, 0.0]])
    texel, weight = texels.bilinear(np.array([2, 3, 4]), np.concatenate([thirds, tip, thirds]))
    np.testing.assert_array_equal(weight, np.tile([1, 0, 0, 0], (3, 1)))
    columns = texels.index % 8
    assert texels.index[texel[0, 0]] == 3 * 8 + 4  # the texel that it lies in, of another chart
    assert texel[1, 0] in owned[2] and columns[texel[1, 0]] == columns[owned[2]].max()  # its own, far away
    assert texels.index[texel[2, 0]] == 7 * 8 + 7  # the corner


def test_a_texel_of_the_chart_nearby_stands_in():
    # The strip's tip lies among texels of the other chart, next to the one that the strip has.
    big = 0.125 * np.array([[[2.2, 0], [8, 0], [8, 8]], [[2.2, 0], [8, 8], [2.2, 8]]])
    strip = 0.125 * np.array([[[1.2, 3.4], [2.9, 3.5], [1.2, 3.6]]])
    uv = np.concatenate([big, strip]).astype(np.float32)
    texels = Texels.rasterize(flat(np.concatenate([big, strip + 3]).astype(np.float32)), uv, 8)
    own = np.flatnonzero(texels.face == 2)
    assert [divmod(int(i), 8) for i in texels.index[own]] == [(4, 1)]
    barycentric = np.array([[0.0, 1.0, 0.0]])
    texel, weight = texels.bilinear(np.array([2]), barycentric)
    assert texel[0, 0] == own[0] and weight[0].tolist() == [1, 0, 0, 0]


def test_values_go_back_to_their_places():
    texels = rasterize(0.5 * SQUARE, 6)
    values = np.stack([texels.index, -texels.index], axis=1).astype(np.float32)
    image = texels.image(values, fill=7.0)
    assert image.shape == (6, 6, 2) and image.dtype == np.float32
    unused = np.setdiff1d(np.arange(36), texels.index)
    np.testing.assert_array_equal(image.reshape(36, 2)[texels.index], values)
    assert len(unused) and (image.reshape(36, 2)[unused] == 7.0).all()
    assert (texels.image(values).reshape(36, 2)[unused] == 0.0).all()


@pytest.mark.parametrize(
    ("uv", "resolution", "message"),
    [
        pytest.param(SQUARE, 0, "resolution 0", id="no texel"),
        pytest.param(SQUARE, 8193, "resolution 8193", id="too large"),
        pytest.param(0.5 + 0 * SQUARE, 8, "no area", id="all UVs coincide"),
        pytest.param(SQUARE + 0.1, 8, "outside", id="outside"),
        pytest.param(SQUARE * np.nan, 8, "outside", id="nan"),
        pytest.param(SQUARE[:1], 8, "shape", id="too few faces"),
    ],
)
def test_what_cannot_be_rasterized_is_refused(uv, resolution, message):
    with pytest.raises(ConfigError, match=message):
        Texels.rasterize(flat(SQUARE), uv, resolution)


def test_a_surface_without_an_area_is_refused():
    mesh = flat(SQUARE)
    with pytest.raises(MeshError, match="area"):
        Texels.rasterize(replace(mesh, vertices=0 * mesh.vertices), SQUARE, 8)
