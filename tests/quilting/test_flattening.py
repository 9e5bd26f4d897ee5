"""Surfaces laid flat around a point: exact where they can be, and without what does not fit."""

from __future__ import annotations

import numpy as np
import pytest

from mitex.mesh import Mesh, grid, icosphere
from mitex.mesh.frames import vertex_directions
from mitex.quilting.flattening import STRETCH, Flattening, _fits
from tests.quilting.tubes import cup, joined, tube

THIRD = np.full(3, 1 / 3)


def flattening(mesh: Mesh, reach: float, kind: str = "fixed") -> Flattening:
    return Flattening(mesh, vertex_directions(mesh, kind), reach)


def test_a_plane_is_what_it_is():
    mesh = grid(24, 24)  # seen from +z: right is +x, up is +y
    barycentric = np.array([0.2, 0.5, 0.3])
    faces, place = flattening(mesh, 0.5)(600, barycentric)
    point = barycentric @ mesh.vertices[mesh.faces[600]]
    np.testing.assert_allclose(place, (mesh.vertices[mesh.faces[faces]] - point)[..., :2], atol=1e-5)
    assert 600 in faces and np.abs(place).max() > 0.3


@pytest.mark.parametrize("cut", [False, True], ids=["whole", "cut"])
def test_a_tube_is_unrolled_across_its_seam(cut: bool):
    """Around it by angle and radius, up by height, also where the vertices of the seam are double."""
    mesh, angle = tube(cut=cut)
    seam = int(np.argmax(np.abs(angle[mesh.faces]).min(1)))  # next to the angle pi
    faces, place = flattening(mesh, 0.6)(seam, THIRD)
    corners = mesh.faces[faces]
    middle = angle[mesh.faces[seam]].mean()
    around = np.angle(np.exp(1j * (angle[corners] - middle)))
    expected = np.stack(
        [around, mesh.vertices[corners][..., 1] - mesh.vertices[mesh.faces[seam], 1].mean()], 2
    )
    np.testing.assert_allclose(place, expected, atol=0.01)
    assert around.min() < -0.3 and around.max() > 0.3


def test_a_thin_tube_is_cut_on_the_far_side():
    mesh, _ = tube(radius=0.2)
    faces, place = flattening(mesh, 1.0)(int(len(mesh.faces) / 2), THIRD)
    assert 0.8 * np.pi * 0.2 < np.abs(place[..., 0]).max() < 1.3 * np.pi * 0.2
    assert len(np.unique(faces)) == len(faces)


@pytest.mark.parametrize("kind", ["fixed", "smooth"])
@pytest.mark.parametrize("radius", [1.0, 0.9], ids=["outside", "inside"])
def test_nothing_is_laid_upside_down_over_a_rim(kind: str, radius: float):
    """There the field turns round: what lies on both walls is upright on both, so a patch ends."""
    mesh = cup()
    middle = mesh.vertices[mesh.faces].mean(1)
    face = int(np.square(middle - np.array([0, 0.9, radius])).sum(1).argmin())
    faces, place = flattening(mesh, 0.8, kind)(face, THIRD)
    wall = np.abs(mesh.face_normals[faces, 1]) < 0.5
    height = mesh.vertices[mesh.faces[faces[wall]]][..., 1]
    up = place[wall, :, 1]
    assert wall.sum() > 100
    assert (((height - height.mean(1, keepdims=True)) * up).sum(1) > 0).all()


def test_turns_are_counter_clockwise():
    angle = 0.4
    flat = flattening(grid(24, 24), 0.5)
    faces, place = flat(600, THIRD)
    cosine, sine = np.cos(angle), np.sin(angle)
    turned = place @ np.array([[cosine, -sine], [sine, cosine]])  # x grows along (cosine, sine)
    np.testing.assert_allclose(flat.turns(faces, place), 0, atol=1e-6)
    np.testing.assert_allclose(flat.turns(faces, turned), angle, atol=1e-6)


def test_nothing_is_mirrored_or_stretched_too_much():
    mesh = icosphere(24)
    flat = flattening(mesh, 0.8, "smooth")
    for face in (0, 100, int(np.argmax(mesh.vertices[mesh.faces][:, :, 1].mean(1)))):
        faces, place = flat(face, THIRD)
        side, there = mesh.vertices[mesh.faces[faces]], np.diff(place, axis=1)
        area = 0.5 * (there[:, 0, 0] * there[:, 1, 1] - there[:, 0, 1] * there[:, 1, 0])
        share = area / mesh.face_areas[faces]
        assert face in faces and len(faces) > 200
        assert (share > STRETCH**-2).all() and (share < STRETCH**2).all()
        np.testing.assert_allclose(THIRD @ place[list(faces).index(face)], 0, atol=1e-9)
        assert np.ptp(side.reshape(-1, 3), axis=0).max() > 0.5


def test_sheets_that_touch_in_an_edge_are_all_covered():
    """Three half planes on one edge: from one of them, both others are reached."""
    half = grid(8, 8).with_vertices(grid(8, 8).vertices * [0.5, 1, 1] + [0.5, 0, 0])
    x, y, z = half.vertices.T
    sheets = [
        half.with_vertices(np.stack([c * x, y, s * x], 1)) for c, s in ((1, 0), (-0.5, 0.9), (-0.5, -0.9))
    ]
    mesh = joined(*sheets)
    faces, _ = flattening(mesh, 1.5)(60, THIRD)
    assert len(np.unique(faces // len(half.faces))) >= 2


def test_faces_without_an_area_do_no_harm():
    mesh = grid(6, 6)
    vertices = mesh.vertices.copy()
    vertices[mesh.faces[30, 0]] = vertices[mesh.faces[30, 1]]
    flat = flattening(mesh.with_vertices(vertices), 0.6)
    for face in (30, 31, 40):
        faces, place = flat(face, THIRD)
        assert face in faces and np.isfinite(place).all()


def test_distances_begin_anew_on_each_part():
    far = grid(4, 4)
    mesh = joined(far, far.with_vertices(far.vertices + [5.0, 0, 0]))
    distances = flattening(mesh, 0.5).distances()
    assert np.isfinite(distances).all()
    np.testing.assert_allclose(distances[: len(far.faces)], distances[len(far.faces) :], atol=1e-5)


def test_what_fits_agrees_with_singular_values():
    rng = np.random.default_rng(0)
    maps = np.eye(2) * rng.uniform(0.5, 2, (2000, 1, 1)) + 0.2 * rng.normal(size=(2000, 2, 2))
    maps[:400, 0] *= -1
    stretches = np.linalg.svd(maps, compute_uv=False)
    expected = (np.linalg.det(maps) > 0) & (stretches[:, 0] < STRETCH) & (stretches[:, 1] > 1 / STRETCH)
    assert 0.2 < expected.mean() < 0.8 and np.array_equal(_fits(maps), expected)
    assert not _fits(np.zeros((1, 2, 2))).any()
