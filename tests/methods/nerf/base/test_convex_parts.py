"""Convex pieces and their union against closed forms."""

import sys

import numpy as np
import pytest

from mitex.errors import MeshError, MissingPackage
from mitex.mesh import Mesh, icosphere, quality
from mitex.methods.nerf.base.convex_parts import GROWN, convex_parts, union


def box(low: tuple[float, float, float], high: tuple[float, float, float]) -> np.ndarray:
    """Its (8, 3) corners."""
    return np.indices((2, 2, 2)).reshape(3, 8).T * np.subtract(high, low) + low


def volume(mesh: Mesh) -> float:
    return float((mesh.vertices[mesh.faces[:, 0]] * mesh.face_crosses).sum() / 6)


def test_two_overlapping_boxes_have_the_volume_of_their_union():
    cell = 0.02
    a, b = (np.array([[0, 0, 0], [1, 0.8, 0.6]]), np.array([[0.5, 0.3, 0.2], [1.4, 1.2, 0.9]]))
    mesh = union([box(*a), box(*b)], cell)
    grow = np.array([[-1], [1]]) * GROWN * cell
    common = np.minimum(a[1], b[1]) - np.maximum(a[0], b[0]) + 2 * GROWN * cell
    expected = np.prod(np.ptp(a + grow, axis=0)) + np.prod(np.ptp(b + grow, axis=0)) - np.prod(common)
    assert volume(mesh) == pytest.approx(expected, rel=2e-3)
    report = quality(mesh)
    assert (report.components, report.boundary_edges, report.non_manifold_edges) == (1, 0, 0)
    assert report.genus == 0
    np.testing.assert_allclose(mesh.vertices.min(0), a[0] - GROWN * cell, atol=1e-5)
    np.testing.assert_allclose(mesh.vertices.max(0), b[1] + GROWN * cell, atol=1e-5)


def test_pieces_that_touch_become_one():
    halves = [box((0, 0, 0), (0.5, 1, 1)), box((0.5, 0, 0), (1, 1, 1))]
    mesh = union(halves, 0.03)
    assert quality(mesh).components == 1
    assert volume(mesh) == pytest.approx((1 + 2 * GROWN * 0.03) ** 3, rel=5e-3)


def test_a_ring_keeps_its_hole_and_a_case_loses_its_hollow():
    ring = [
        box((0, 0, 0), (3, 1, 1)),
        box((0, 2, 0), (3, 3, 1)),
        box((0, 0, 0), (1, 3, 1)),
        box((2, 0, 0), (3, 3, 1)),
    ]
    assert quality(union(ring, 0.1)).genus == 1
    lids = [box((0, 0, z), (3, 3, z + 0.5)) for z in (-0.5, 1.0)]
    closed = union(ring + lids, 0.1)
    assert (quality(closed).components, quality(closed).genus) == (1, 0)


def test_a_ball_of_many_planes():
    mesh = union([icosphere(6).vertices], 0.05)
    np.testing.assert_allclose(np.linalg.norm(mesh.vertices, axis=1), 1 + GROWN * 0.05, atol=0.02)


def test_flat_pieces_are_left_out():
    flat = box((0, 0, 0), (1, 1, 0))
    solid = box((0, 0, 0), (1, 1, 1))
    np.testing.assert_array_equal(union([flat, solid], 0.1).vertices, union([solid], 0.1).vertices)
    with pytest.raises(MeshError, match="no volume"):
        union([flat], 0.1)


def test_pieces_cover_a_shape_that_is_not_convex():
    pytest.importorskip("coacd")
    corner = union([box((0, 0, 0), (2, 1, 1)), box((0, 0, 0), (1, 2, 1))], 0.3)
    pieces = convex_parts(corner, 0.1)
    assert len(pieces) > 1
    assert volume(union(pieces, 0.05)) == pytest.approx(volume(corner), rel=0.1)
    assert len(convex_parts(corner, 1.0)) == 1


def test_coacd_is_silent(capfd):
    pytest.importorskip("coacd")
    convex_parts(icosphere(3), 0.3)
    assert capfd.readouterr() == ("", "")


def test_names_the_extra_that_is_missing(monkeypatch):
    monkeypatch.setitem(sys.modules, "coacd", None)
    with pytest.raises(MissingPackage, match=r"pip install 'mitex\[nerf\]'"):
        convex_parts(icosphere(2), 0.1)


def test_a_shape_without_pieces(monkeypatch):
    coacd = pytest.importorskip("coacd")
    monkeypatch.setattr(coacd, "run_coacd", lambda *_, **__: [])
    with pytest.raises(MeshError, match="icosphere2 has no convex parts; give a base mesh"):
        convex_parts(icosphere(2), 0.1)
