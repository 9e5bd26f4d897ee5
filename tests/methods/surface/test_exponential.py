"""Straightest geodesics: surfaces that unroll to a plane, the sphere, a slow walk in space."""

import math

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from mitex.mesh import Mesh, icosphere
from mitex.methods.surface.exponential import GeodesicTracer
from tests.methods.surface.walks import bumpy, end_points, plane, positions, random_rays


def _to_border(start, direction) -> np.ndarray:
    """Distance along the direction to the border of the unit square."""
    with np.errstate(divide="ignore"):
        return np.where(direction > 0, (1 - start) / direction, -start / direction)[:, :2].min(axis=1)


def test_a_plane_is_left_straight(rng):
    mesh = plane(rng)
    face, weights, direction = random_rays(mesh, 3000, rng)
    start = positions(mesh, face, weights)
    length = 0.999 * _to_border(start, direction) * rng.random(3000)
    arrival = GeodesicTracer(mesh).trace(face, weights, direction, length)
    assert arrival.arrived.all()
    np.testing.assert_allclose(end_points(mesh, arrival), start + length[:, None] * direction, atol=1e-12)
    assert (arrival.face != face).mean() > 0.5  # it did cross faces


def test_walks_along_edges_go_straight_on(rng):
    """Rounding decides on which side vertices are passed, and whether edges are crossed."""
    mesh = plane(rng)
    face = rng.integers(0, len(mesh.faces), 4000)
    weights = np.eye(3)[rng.integers(0, 3, 4000)]  # half at a corner, half on a side
    weights[::2] = rng.permuted(np.insert(rng.dirichlet([1.0, 1.0], 2000), 0, 0.0, axis=1), axis=1)
    corners = mesh.vertices[mesh.faces[face]].astype(np.float64)
    side, turned = rng.integers(0, 3, 4000), rng.choice([-1.0, 1.0], (4000, 1))
    direction = turned * (corners[np.arange(4000), side] - corners[np.arange(4000), side - 1])
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    start = positions(mesh, face, weights)
    inner = (np.abs(start[:, :2] - 0.5) < 0.5 - 1e-9).all(axis=1) & (direction[:, :2] != 0.0).all(axis=1)
    face, weights, direction, start = face[inner], weights[inner], direction[inner], start[inner]
    length = 0.999 * _to_border(start, direction) * rng.random(len(face))
    arrival = GeodesicTracer(mesh).trace(face, weights, direction, length)
    assert len(face) > 3000 and arrival.arrived.all()
    np.testing.assert_allclose(end_points(mesh, arrival), start + length[:, None] * direction, atol=1e-12)


def test_walks_stop_on_the_boundary(rng):
    mesh = plane(rng)
    face, weights, direction = random_rays(mesh, 1000, rng)
    start = positions(mesh, face, weights)
    reach = _to_border(start, direction)
    arrival = GeodesicTracer(mesh).trace(face, weights, direction, reach + rng.random(1000))
    assert not arrival.arrived.any()
    np.testing.assert_allclose(end_points(mesh, arrival), start + reach[:, None] * direction, atol=1e-11)


def test_directions_are_projected_and_of_any_length(rng):
    mesh = plane(rng)
    face, weights, direction = random_rays(mesh, 100, rng)
    normal = mesh.face_crosses[face] / np.linalg.norm(mesh.face_crosses[face], axis=1, keepdims=True)
    tracer = GeodesicTracer(mesh)
    expected = end_points(mesh, tracer.trace(face, weights, direction, 0.1))
    for factor in (1e-200, 3.0, 1e200):
        tilted = factor * (direction + 2.0 * normal)
        np.testing.assert_allclose(
            end_points(mesh, tracer.trace(face, weights, tilted, 0.1)), expected, atol=1e-12
        )


def _prism(sides: int, rng) -> tuple[Mesh, np.ndarray]:
    """A tube of `sides` x 12 split quads, exactly a prism, and its unrolled corners (F, 3, 2)."""
    angle = np.arange(sides) * 2 * np.pi / sides
    profile = np.column_stack([np.cos(angle), np.sin(angle)]).astype(np.float32)
    chords = np.linalg.norm(np.diff(profile[np.r_[:sides, 0]].astype(float), axis=0), axis=1)
    height = np.cumsum(rng.uniform(0.1, 0.5, 13)).astype(np.float32)
    vertices = np.concatenate([np.column_stack([profile, np.full(sides, z)]) for z in height])
    i, j = np.divmod(np.arange(12 * sides), sides)
    a, b = i * sides + j, i * sides + (j + 1) % sides
    faces = np.stack([np.stack([a, b, b + sides], 1), np.stack([a, b + sides, a + sides], 1)], 1)
    at = np.r_[0.0, np.cumsum(chords)]
    left, right, low, high = at[j], at[j + 1], height[i], height[i + 1]
    flat = [[left, low], [right, low], [right, high], [left, low], [right, high], [left, high]]
    unrolled = np.array(flat, float).transpose(2, 0, 1).reshape(-1, 3, 2)
    return Mesh(vertices, faces.reshape(-1, 3)), unrolled


def _flat_direction(mesh: Mesh, unrolled: np.ndarray, face, direction) -> np.ndarray:
    """Directions carried to an unrolled surface, (M, 2)."""
    corners = mesh.vertices[mesh.faces[face]].astype(np.float64)
    sides, flat = corners[:, 1:] - corners[:, :1], unrolled[face, 1:] - unrolled[face, :1]
    gram, right = sides @ sides.transpose(0, 2, 1), np.einsum("mkd,md->mk", sides, direction)
    return np.einsum("mk,mkd->md", np.linalg.solve(gram, right[..., None])[..., 0], flat)


def test_a_cylinder_unrolls(rng):
    mesh, unrolled = _prism(64, rng)
    face, weights, direction = random_rays(mesh, 2000, rng)
    start = np.einsum("mk,mkd->md", weights, unrolled[face])
    flat = _flat_direction(mesh, unrolled, face, direction)
    length = rng.uniform(0.0, 20.0, 2000)
    end = start + length[:, None] * flat
    stays = (end[:, 1] > unrolled[..., 1].min()) & (end[:, 1] < unrolled[..., 1].max())
    arrival = GeodesicTracer(mesh).trace(face, weights, direction, length)
    np.testing.assert_array_equal(arrival.arrived, stays)
    offset = np.einsum("mk,mkd->md", arrival.barycentric, unrolled[arrival.face]) - end
    around = unrolled[..., 0].max()
    offset[:, 0] -= np.round(offset[:, 0] / around) * around
    assert (length[stays] > around).any()
    np.testing.assert_allclose(offset[stays], 0.0, atol=1e-11)
    # On the round cylinder an arc is at most 1 / sinc(pi / n) times as long as its chord.
    points = end_points(mesh, arrival)
    turn = np.arctan2(points[:, 1], points[:, 0]) - end[:, 0]
    turn -= np.round(turn / (2 * np.pi)) * 2 * np.pi
    # ... and a point of a chord is no more off in angle than the chord is long, cubed, over 24.
    bound = (np.abs(end[:, 0]) + 0.1) * (np.pi / 64 / math.sin(np.pi / 64) - 1) + (2 * np.pi / 64) ** 3 / 24
    assert (np.abs(turn) <= bound + 1e-6)[stays].all()


@pytest.mark.parametrize("slope", [0.3, 2.0, 8.0])
def test_a_cone_unrolls(slope, rng):
    """Steep cones have a small angle at the tip, which straight lines wind around several times."""
    sides, rings = 20, 6
    angle = np.arange(sides) * 2 * np.pi / sides + rng.uniform(-0.05, 0.05, sides)
    ring = np.column_stack([np.cos(angle), np.sin(angle), np.full(sides, -slope)]).astype(np.float32)
    vertices = np.concatenate([ring / 2**k for k in range(rings)] + [np.zeros((1, 3), np.float32)])
    j = np.arange(sides)
    n = (j + 1) % sides
    faces = [np.column_stack([j + (rings - 1) * sides, n + (rings - 1) * sides, 0 * j + rings * sides])]
    for k in range(rings - 1):
        low, high = k * sides, (k + 1) * sides
        faces += [
            np.column_stack([j + low, n + low, n + high]),
            np.column_stack([j + low, n + high, j + high]),
        ]
    mesh = Mesh(vertices, np.concatenate(faces))
    edges = ring.astype(float)
    reach = np.linalg.norm(edges, axis=1)
    wedge = np.arccos((edges * edges[n]).sum(axis=1) / (reach * reach[n]))
    at = np.r_[0.0, np.cumsum(wedge)]
    total = at[-1]
    wedge_of = np.concatenate([j] * (2 * rings - 1))

    def polar(face, weights):
        """Distance from the tip, and the angle around it."""
        flat = np.einsum("mk,mkd->md", weights, flat_corners[face])
        return np.linalg.norm(flat, axis=1), np.arctan2(flat[:, 1], flat[:, 0]) + at[wedge_of[face]]

    corner_wedge = (mesh.faces % sides) != wedge_of[:, None]  # the later edge of the wedge
    size = np.linalg.norm(mesh.vertices[mesh.faces].astype(float), axis=2)
    turn = np.where(corner_wedge, wedge[wedge_of][:, None], 0.0)
    flat_corners = size[..., None] * np.stack([np.cos(turn), np.sin(turn)], axis=-1)

    face, weights, direction = random_rays(mesh, 1500, rng)
    start = np.einsum("mk,mkd->md", weights, flat_corners[face])
    flat = _flat_direction(mesh, flat_corners, face, direction)
    length = rng.uniform(0.0, 1.5, 1500) * reach.min()
    arrival = GeodesicTracer(mesh).trace(face, weights, direction, length)
    end = start + length[:, None] * flat
    swept = np.arctan2(start[:, 0] * end[:, 1] - start[:, 1] * end[:, 0], (start * end).sum(axis=1))
    expected = polar(face, weights)[1] + swept
    radius, around = polar(arrival.face, arrival.barycentric)
    off = (around - expected) / total
    # Rays towards the tip within rounding of it may pass it on either side.
    arrived = arrival.arrived
    assert arrived.sum() > 400
    np.testing.assert_allclose(radius[arrived], np.linalg.norm(end, axis=1)[arrived], rtol=1e-9)
    np.testing.assert_allclose(((off - np.round(off)) * radius)[arrived], 0.0, atol=1e-9)
    if slope == 8.0:
        assert (np.abs(swept[arrived]) > total).any()
    assert np.isfinite(end_points(mesh, arrival)).all()


def test_the_sphere_is_walked_along_great_circles(rng):
    errors = []
    for frequency in (8, 16, 32):
        mesh = icosphere(frequency)
        face, weights, direction = random_rays(mesh, 2000, rng)
        start = positions(mesh, face, weights)
        start /= np.linalg.norm(start, axis=1, keepdims=True)
        tangent = direction - start * (start * direction).sum(axis=1, keepdims=True)
        tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
        arrival = GeodesicTracer(mesh).trace(face, weights, direction, 1.0)
        assert arrival.arrived.all()
        off = end_points(mesh, arrival) - np.cos(1.0) * start - np.sin(1.0) * tangent
        errors.append(np.linalg.norm(off, axis=1).mean())
    assert errors[0] < 0.05
    assert errors[0] > 2.0 * errors[1] > 4.0 * errors[2]


def test_there_and_back(rng):
    mesh = bumpy(rng)
    tracer = GeodesicTracer(mesh)
    face, weights, direction = random_rays(mesh, 1000, rng)
    there = tracer.trace(face, weights, direction, 2.0)
    before = tracer.trace(face, weights, direction, 2.0 - 1e-3)
    same = there.face == before.face
    assert same.mean() > 0.9 and there.arrived.all()
    backwards = end_points(mesh, before) - end_points(mesh, there)
    back = tracer.trace(there.face, there.barycentric, backwards, 2.0)
    off = np.linalg.norm(end_points(mesh, back) - positions(mesh, face, weights), axis=1)[same]
    # Rounding turns the direction by 1e-13, which curvature spreads; on the way a vertex may be passed on the
    # other side.
    assert np.quantile(off, 0.99) < 1e-9


def _slow_walk(mesh: Mesh, face: int, point, direction, length: float) -> np.ndarray:
    """One face at a time in space: the direction turns around the edge with the hinge."""
    vertices = mesh.vertices.astype(np.float64)
    crossed = None
    while True:
        triangle = mesh.faces[face].tolist()
        best = (math.inf, -1, -1)
        for a, b in zip(triangle, triangle[1:] + triangle[:1], strict=True):
            if {a, b} == crossed:
                continue
            edge = vertices[b] - vertices[a]
            # Where the ray meets the line: least squares of a + s edge = point + t direction.
            (s, t), *_ = np.linalg.lstsq(np.column_stack([edge, -direction]), point - vertices[a], rcond=None)
            if 0.0 <= s <= 1.0 and t > 0.0:
                best = min(best, (float(t), a, b))
        distance, a, b = best
        if distance >= length:
            return point + length * direction
        point, length = point + distance * direction, length - distance
        crossed = {a, b}
        other = next(f for f, t in enumerate(mesh.faces.tolist()) if f != face and crossed <= set(t))
        axis = (vertices[b] - vertices[a]) / np.linalg.norm(vertices[b] - vertices[a])
        before, after = mesh.face_crosses[face], mesh.face_crosses[other]
        hinge = math.atan2(np.cross(before, after) @ axis, before @ after)
        direction = Rotation.from_rotvec(hinge * axis).apply(direction)
        face = other


def test_a_slow_walk_in_space(rng):
    mesh = bumpy(rng)
    face, weights, direction = random_rays(mesh, 50, rng)
    length = rng.uniform(0.0, 3.0, 50)
    arrival = GeodesicTracer(mesh).trace(face, weights, direction, length)
    start = positions(mesh, face, weights)
    expected = [_slow_walk(mesh, *ray) for ray in zip(face, start, direction, length, strict=True)]
    assert arrival.arrived.all()
    np.testing.assert_allclose(end_points(mesh, arrival), expected, atol=1e-10)
