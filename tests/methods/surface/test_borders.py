"""Border texels: continued over seams along geodesics, else read from inside."""

import numpy as np
import pytest

from mitex.atlas import unwrap
from mitex.mesh import Mesh, icosphere
from mitex.methods.surface.borders import Border
from mitex.methods.surface.exponential import GeodesicTracer
from mitex.methods.surface.taps import Surroundings, build
from mitex.texels import Texels
from tests.mesh.examples import tangent_frames


def folded() -> tuple[Mesh, np.ndarray]:
    """Two unit squares side by side in a plane, x in [0, 2], whose charts lie apart and off the texels."""
    points = np.array([[0, 0, 0], [1, 0, 0], [2, 0, 0], [0, 1, 0], [1, 1, 0], [2, 1, 0]], np.float32)
    faces = np.array([[0, 1, 4], [0, 4, 3], [1, 2, 5], [1, 5, 4]])
    uv = 0.35 * points[faces][..., :2] + np.array([0.043, 0.057])
    uv[2:, :, 0] += 0.148
    return Mesh(points, faces, uv.astype(np.float32), "folded"), uv.astype(np.float32)


def border_of(mesh: Mesh, uv: np.ndarray, resolution: int) -> tuple[Texels, Border]:
    texels = Texels.rasterize(mesh, uv, resolution)
    return texels, Border.continued(mesh, texels, GeodesicTracer(mesh))


def centres(texels: Texels, uv: np.ndarray) -> np.ndarray:
    """(N, 2) places in the plane of `folded` that the texels' centres unfold to."""
    row, column = np.divmod(texels.index, texels.resolution)
    place = np.stack([column + 0.5, texels.resolution - row - 0.5], 1) / texels.resolution
    right = (texels.face >= 2)[:, None] * np.array([0.148, 0.0])
    return (place - [0.043, 0.057] - right) / 0.35


def test_a_linear_function_goes_on_over_the_seam():
    """Bilinear lookups on the other side give it exactly, except where the mesh ends."""
    mesh, uv = folded()
    texels, border = border_of(mesh, uv, 64)
    place = centres(texels, uv)
    values = border.spread @ place[border.elements]
    away = np.abs(values - place).max(1)
    step = texels.size
    inner = (place[:, 1] > 2 * step) & (place[:, 1] < 1 - 2 * step)
    inner &= (place[:, 0] > 2 * step) & (place[:, 0] < 2 - 2 * step)
    across = inner & ~texels.inside
    assert across.sum() > 10 and away[inner].max() < 1e-5
    assert away.max() < 1.5 * step  # at the mesh's own border: from inside


def test_rows_are_shares():
    mesh = icosphere(8)
    texels, border = border_of(mesh, unwrap(mesh, 64, 2), 64)
    assert np.allclose(border.spread.sum(axis=1), 1, atol=1e-5) and border.spread.data.min() >= 0
    assert np.array_equal(border.elements, np.flatnonzero(texels.inside))
    own = border.spread[border.elements]
    assert (own.indices == np.arange(len(border.elements))).all() and (own.data == 1).all()


@pytest.mark.parametrize("resolution", [1, 2, 3])
def test_few_texels(resolution):
    """Some values remain, whatever there is."""
    mesh, uv = folded()
    _, border = border_of(mesh, uv, resolution)
    assert len(border.elements) >= 1 and np.allclose(border.spread.sum(axis=1), 1, atol=1e-5)


def test_nothing_is_continued_on_request():
    border = Border.none(5)
    assert np.array_equal(border.spread.toarray(), np.eye(5))


def test_levels_of_the_elements():
    """Border texels are in no group, and what they show is read in their place."""
    mesh = icosphere(8)
    texels, border = border_of(mesh, unwrap(mesh, 64, 2), 64)
    frames = tangent_frames(mesh, texels.face, texels.barycentric)
    levels = build(Surroundings(texels, GeodesicTracer(mesh), *frames, border=border))
    assert np.array_equal(np.sort(levels.order), border.elements)
    assert levels.spread.shape == (len(texels.index), len(border.elements))
    position = texels.position[levels.order]
    there = (levels.lookup @ position).reshape(-1, 9, 3)
    away = np.linalg.norm(there - position[:, None], axis=2) / texels.size
    assert abs(np.median(away[:, [1, 3, 5, 7]]) - 1) < 0.05 and away[:, 4].max() == 0
    expected = texels.position[border.elements]
    assert np.allclose((levels.spread @ position)[border.elements], expected)
