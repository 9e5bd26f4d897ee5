"""Geodesic walks through vertices, along borders, over a peak and nowhere, at any scale; what is refused."""

import math

import numpy as np
import pytest

from mitex.errors import ConfigError
from mitex.mesh import grid, icosphere
from mitex.methods.surface import exponential
from mitex.methods.surface.exponential import GeodesicTracer
from tests.mesh.examples import octahedron
from tests.methods.surface.walks import bumpy, end_points, locate, plane, positions, random_rays

EVEN = np.full(3, 1.0 / 3.0)


def test_nothing_to_walk(rng):
    mesh = icosphere(3)
    face, weights, direction = random_rays(mesh, 20, rng)
    tracer = GeodesicTracer(mesh)
    still = tracer.trace(face, weights, direction, 0.0)
    assert still.arrived.all()
    for lost in (0.0 * direction, mesh.face_crosses[face]):
        arrival = tracer.trace(face, weights, lost, 1.0)
        assert not arrival.arrived.any()
        np.testing.assert_array_equal(arrival.face, face)
        np.testing.assert_allclose(arrival.barycentric, weights, atol=1e-15)
    np.testing.assert_array_equal(still.face, face)
    np.testing.assert_allclose(still.barycentric, weights, atol=1e-14)
    nothing = tracer.trace([], np.empty((0, 3)), np.empty((0, 3)), 1.0)
    assert nothing.face.shape == (0,) and nothing.face.dtype == np.int32
    assert nothing.barycentric.shape == (0, 3)


@pytest.mark.parametrize("direction", [(1, 0), (0, 1), (1, 1), (-1, 1), (-1, -1), (0, -1), (3, 1)])
def test_vertices_and_edges_are_walked_through(direction):
    """The grid's vertices are dyadic, so that the rays hit them exactly."""
    mesh = grid(16, 16)
    face, weights = locate(mesh, (-0.125, 0.25))  # a vertex
    unit = np.array([[*direction, 0.0]]) / math.hypot(*direction)
    for length in (0.125, 0.3, 0.5):
        for around in np.flatnonzero((mesh.faces == mesh.faces[face[0], weights[0].argmax()]).any(axis=1)):
            corner = (mesh.faces[around] == mesh.faces[face[0], weights[0].argmax()]).astype(float)
            arrival = GeodesicTracer(mesh).trace([around], corner[None], unit, length)
            assert arrival.arrived.all()
            expected = np.array([[-0.125, 0.25, 0.0]]) + length * unit
            np.testing.assert_allclose(end_points(mesh, arrival), expected, atol=1e-14)


@pytest.mark.parametrize("size", [1.0, 2.0**20, 2.0**-20])
def test_a_straight_boundary_can_be_walked_along(size):
    mesh = grid(16, 16)
    face = np.flatnonzero((mesh.vertices[mesh.faces][:, :2, 1] == -1).all(axis=1))[:1]  # the first row
    mesh = mesh.with_vertices(mesh.vertices * size)
    start = positions(mesh, face, np.array([[0.5, 0.5, 0.0]]))
    arrival = GeodesicTracer(mesh).trace(face, [[0.5, 0.5, 0.0]], [[1.0, 0.0, 0.0]], 1.8 * size)
    assert arrival.arrived.all()
    np.testing.assert_allclose(end_points(mesh, arrival) / size, start / size + [[1.8, 0, 0]], atol=1e-14)


def test_a_peak_is_passed_on_one_side():
    """From the middle of an edge up to the peak (0, 0, 1) of four faces of 60 degrees, and on."""
    mesh = octahedron()
    arrival = GeodesicTracer(mesh).trace([0], [[0.0, 0.5, 0.5]], [[0.0, -1.0, 1.0]], math.sqrt(2.0))
    # 180 degrees are three faces on: the edge to (1, 0, 0), or the one to (-1, 0, 0).
    assert arrival.arrived.all()
    np.testing.assert_allclose(np.abs(end_points(mesh, arrival)), [[0.5, 0.0, 0.5]], atol=1e-12)


@pytest.mark.parametrize("factor", [1e-6, 1e6, 1e-30, 1e30])
def test_the_scale_does_not_matter(factor, rng):
    mesh = bumpy(rng)
    power = 2.0 ** round(math.log2(factor))  # exact in float32
    face, weights, direction = random_rays(mesh, 300, rng)
    one = GeodesicTracer(mesh).trace(face, weights, direction, 1.0)
    other = GeodesicTracer(mesh.with_vertices(mesh.vertices * power)).trace(face, weights, direction, power)
    assert other.arrived.all()
    np.testing.assert_array_equal(one.face, other.face)
    np.testing.assert_allclose(one.barycentric, other.barycentric, atol=1e-10)


def test_crossings_are_bounded(rng, monkeypatch):
    mesh = plane(rng)
    face, weights = locate(mesh, (0.01, 0.03))
    tracer = GeodesicTracer(mesh)
    assert tracer.trace(face, weights, [[1.0, 1.0, 0.75]], 1.0).arrived.all()
    monkeypatch.setattr(exponential, "MAX_CROSSINGS", 3)
    assert not tracer.trace(face, weights, [[1.0, 1.0, 0.75]], 1.0).arrived.any()


def test_parts_are_walked_like_the_whole(rng, monkeypatch):
    mesh = bumpy(rng)
    rays = random_rays(mesh, 100, rng)
    length = rng.random(100)
    whole = GeodesicTracer(mesh).trace(*rays, length)
    monkeypatch.setattr(exponential, "CHUNK", 33)
    parts = GeodesicTracer(mesh).trace(*rays, length)
    np.testing.assert_array_equal(whole.face, parts.face)
    np.testing.assert_array_equal(whole.barycentric, parts.barycentric)
    np.testing.assert_array_equal(whole.arrived, parts.arrived)


GOOD = {"face": [0], "barycentric": EVEN[None], "direction": [[1.0, 0.0, 0.0]], "length": 0.1}


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"face": [-1]}, "faces from -1"),
        ({"face": [80]}, "faces from 80 to 80 of a mesh that has 80"),
        ({"face": [0.0]}, "integers"),
        ({"face": [[0]]}, "integers"),
        ({"face": [0, 1]}, "barycentric has shape"),
        ({"barycentric": [[np.nan, 0.5, 0.5]]}, "barycentric has numbers"),
        ({"barycentric": [[-0.5, 0.5, 1.0]]}, "outside"),
        ({"barycentric": [[0.5, 0.5, 0.5]]}, "outside"),
        ({"barycentric": [[0.5, 0.5]]}, "barycentric has shape"),
        ({"direction": [[np.inf, 0.0, 0.0]]}, "direction has numbers"),
        ({"direction": [[1.0, 0.0]]}, "direction has shape"),
        ({"length": np.nan}, "length has numbers"),
        ({"length": -0.1}, "the length -0.1"),
        ({"length": [0.1, 0.1]}, "length has shape"),
    ],
)
def test_what_is_refused(changed, message):
    tracer = GeodesicTracer(icosphere(2))
    assert tracer.trace(**GOOD).arrived.all()
    with pytest.raises(ConfigError, match=message):
        tracer.trace(**{**GOOD, **changed})
