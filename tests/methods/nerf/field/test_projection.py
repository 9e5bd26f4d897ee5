"""Projection against closed forms and a slow reference, inside and outside; its derivative."""

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError, MeshError
from mitex.mesh import Mesh, grid, icosphere, subdivide_midpoint
from mitex.methods.nerf.field.projection import MISSED, Projection, Projections, attach

SAGITTA = 1.5e-4  # how far the faces of icosphere(45) lie below the unit sphere


@pytest.fixture(scope="module")
def ball() -> Mesh:
    return icosphere(45)


def box(subdivisions: int = 0) -> Mesh:
    """The cube [-0.5, 0.5]^3: 12 faces, split in four some times."""
    quads = np.array([[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]])
    faces = np.concatenate([quads[:, [0, 1, 2]], quads[:, [0, 2, 3]]])
    mesh = Mesh(np.indices((2, 2, 2)).reshape(3, -1).T - 0.5, faces, name="box")
    return subdivide_midpoint(mesh, subdivisions) if subdivisions else mesh


def spread(rng: np.random.Generator, count: int, low: float, high: float) -> np.ndarray:
    """Points around the origin with radii in [low, high]."""
    x = rng.normal(size=(count, 3))
    x *= rng.uniform(low, high, (count, 1)) / np.linalg.norm(x, axis=1, keepdims=True)
    return x.astype(np.float32)


def slow(mesh: Mesh, x: np.ndarray, neighbours: int, repulsion: float | None) -> tuple[float, np.ndarray]:
    """Signed distance and normal of one point in float64: equation 1, and the plane of every face."""
    x, vertices = x.astype(np.float64), mesh.vertices.astype(np.float64)
    distance = np.linalg.norm(vertices - x, axis=1)
    near = np.argsort(distance)[:neighbours]
    weight = 1 / distance[near]
    normal = (weight[:, None] * mesh.normals[near]).sum(0)
    if repulsion is not None:
        unit = (x - vertices[near]) / distance[near, None]
        away = (weight[:, None] * unit).sum(0) / weight.sum()
        normal = normal + (away if away @ normal > 0 else -away) / repulsion
    normal /= np.linalg.norm(normal)
    a, b, c = vertices[mesh.faces].transpose(1, 0, 2)
    matrix = np.stack([b - a, c - a, np.broadcast_to(normal, a.shape)], 2)
    u, v, t = np.linalg.solve(matrix, (x - a)[..., None])[..., 0].T
    inside = np.minimum(np.minimum(u, v), 1 - u - v) >= 0
    return min(t[inside], key=abs, default=MISSED), normal


def assert_consistent(mesh: Mesh, x: np.ndarray, feet: Projections) -> None:
    """All parts of the feet that were hit describe one place, and the missed ones are marked as such."""
    hit = feet.hit
    np.testing.assert_allclose(np.linalg.norm(feet.normal[hit], axis=1), 1, atol=1e-6)
    np.testing.assert_allclose(
        feet.point[hit], (x - feet.distance[:, None] * feet.normal)[hit], atol=1e-5, rtol=0
    )
    b, corners = feet.barycentric[hit], mesh.vertices[mesh.faces[feet.face[hit]]]
    weights = np.stack([1 - b.sum(1), b[:, 0], b[:, 1]], 1)
    on_face = np.einsum("nk,nkc->nc", weights, corners)
    np.testing.assert_allclose(feet.point[hit], on_face, atol=1e-5, rtol=0)
    assert (feet.distance[~hit] == MISSED).all()
    assert not feet.normal[~hit].any() and not feet.barycentric[~hit].any()
    np.testing.assert_array_equal(feet.point[~hit], x[~hit])


@pytest.mark.parametrize(("low", "high"), [(1.0, 2.0), (0.1, 1.0)], ids=["outside", "inside"])
def test_on_a_sphere_the_distance_is_the_radius_less_one(ball, rng, low, high):
    x = spread(rng, 5000, low, high)
    feet = Projection(ball)(x)
    radius = np.linalg.norm(x, axis=1)
    assert feet.hit.all()
    np.testing.assert_allclose(feet.distance, radius - 1, atol=2 * SAGITTA)
    np.testing.assert_allclose(feet.point, x / radius[:, None], atol=0.02)
    assert_consistent(ball, x, feet)


def test_normals_point_outwards_on_both_sides_of_a_sphere(ball, rng):
    x = spread(rng, 2000, 0.8, 1.2)
    outward = x / np.linalg.norm(x, axis=1, keepdims=True)
    assert ((Projection(ball)(x).normal * outward).sum(1) > 0.999).all()


def test_on_a_plane_it_is_the_orthogonal_projection(rng):
    x = rng.uniform(-0.7, 0.7, (2000, 3)).astype(np.float32)
    feet = Projection(grid(20, 20), repulsion=None)(x)
    np.testing.assert_allclose(feet.distance, x[:, 2], atol=1e-6)
    np.testing.assert_allclose(feet.point, x * (1, 1, 0), atol=1e-6)
    np.testing.assert_allclose(feet.normal, np.tile((0, 0, 1), (2000, 1)), atol=1e-6)


def test_the_pull_tilts_the_projection_onto_a_plane_a_little(rng):
    x = rng.uniform(-0.7, 0.7, (2000, 3)).astype(np.float32)
    feet = Projection(grid(20, 20))(x)
    np.testing.assert_allclose(feet.distance * feet.normal[:, 2], x[:, 2], atol=1e-6)
    np.testing.assert_allclose(feet.point[:, 2], 0, atol=1e-6)
    assert 0.001 < np.linalg.norm(feet.point - x * (1, 1, 0), axis=1).mean() < 0.05


@pytest.mark.parametrize("side", [1.0, -1.0], ids=["outside", "inside"])
def test_on_a_box_it_is_the_orthogonal_projection_away_from_the_edges(rng, side):
    mesh = box(4)
    height = rng.uniform(0.0, 0.15, 3000)
    x = rng.uniform(-0.25, 0.25, (3000, 3))
    axis, sign = rng.integers(0, 3, 3000), rng.choice([-1, 1], 3000)
    foot = x.copy()
    foot[np.arange(3000), axis] = 0.5 * sign
    x[np.arange(3000), axis] = sign * (0.5 + side * height)
    feet = Projection(mesh, repulsion=None)(x)
    np.testing.assert_allclose(feet.distance, side * height, atol=1e-6)
    np.testing.assert_allclose(feet.point, foot, atol=1e-6)


@pytest.mark.parametrize("repulsion", [0.05, None])
@pytest.mark.parametrize("neighbours", [5, 8])
def test_it_agrees_with_a_slow_reference(rng, neighbours, repulsion):
    mesh = icosphere(3)
    mesh = mesh.with_vertices(mesh.vertices * (1.0, 0.6, 0.4) + rng.normal(size=mesh.vertices.shape) * 0.02)
    x = rng.uniform(-1.2, 1.2, (150, 3)).astype(np.float32)
    feet = Projection(mesh, neighbours=neighbours, repulsion=repulsion)(x)
    for k in range(len(x)):
        distance, normal = slow(mesh, x[k], neighbours, repulsion)
        assert feet.distance[k] == pytest.approx(distance, abs=1e-4)
        if feet.hit[k]:
            np.testing.assert_allclose(feet.normal[k], normal, atol=1e-4)


@pytest.mark.parametrize("shift", [0.0, 1e-7, -1e-7, 1e-6, -1e-6, 1e-5, -1e-5])
@pytest.mark.parametrize("where", ["vertices", "edges", "faces"])
def test_points_on_the_surface_are_their_own_feet(where, shift):
    ball = icosphere(20)
    corners = ball.vertices[ball.faces]
    x = {"vertices": ball.vertices, "edges": corners[:, :2].mean(1), "faces": corners.mean(1)}[where]
    x = x * np.float32(1 + shift)
    feet = Projection(ball)(x)
    assert feet.hit.all()
    np.testing.assert_allclose(feet.distance, shift, atol=5e-7)
    np.testing.assert_allclose(feet.point, x, atol=abs(shift) + 1e-6)
    assert (np.einsum("nc,nc->n", feet.normal, x) > 0.99).all()


def test_it_turns_with_the_mesh(ball, rng):
    mesh = ball.with_vertices(ball.vertices * (1.0, 0.7, 0.5))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn = turn * np.sign(np.linalg.det(turn))
    x = spread(rng, 1000, 0.3, 1.5)
    feet = Projection(mesh)(x)
    turned = Projection(mesh.with_vertices(mesh.vertices @ turn.T))(x @ turn.T.astype(np.float32))
    assert (feet.face == turned.face).mean() > 0.99
    np.testing.assert_allclose(turned.distance, feet.distance, atol=1e-3)
    # Another grid may list the ninth vertex in place of the eighth.
    away = np.abs(turned.normal - feet.normal @ turn.T).max(axis=1)
    assert np.quantile(away, 0.99) < 1e-3 and away.max() < 0.05


def test_points_beside_an_open_surface_are_missed(rng):
    x = rng.uniform(-1, 1, (500, 3)).astype(np.float32)
    x[:250, 0] += 3
    feet = Projection(grid(8, 8), repulsion=None)(x)
    np.testing.assert_array_equal(feet.hit, x[:, 0] <= 1)
    assert_consistent(grid(8, 8), x, feet)


def test_a_hole_changes_nothing_elsewhere(ball, rng):
    keep = (ball.vertices[ball.faces][..., 2] < 0.7).all(1)
    cut = Mesh(ball.vertices, ball.faces[keep], name="cut")
    x = spread(rng, 4000, 0.7, 1.3)
    whole, holed = Projection(ball)(x), Projection(cut)(x)
    assert_consistent(cut, x, holed)
    solid = x[:, 2] < 0.65 * np.linalg.norm(x, axis=1)
    np.testing.assert_allclose(holed.distance[solid], whole.distance[solid], atol=1e-5)
    over = x[:, 2] > 0.85 * np.linalg.norm(x, axis=1)
    # Rays through the hole meet the other side, far away, or nothing.
    assert over.any() and (np.abs(holed.distance[over]) > 0.3).all()


def test_vertices_without_a_face_do_not_count(rng):
    mesh = icosphere(8)
    stray = Mesh(np.concatenate([mesh.vertices, mesh.vertices * 1.1]), mesh.faces)
    x = spread(rng, 500, 0.9, 1.3)
    np.testing.assert_allclose(Projection(stray)(x).distance, Projection(mesh)(x).distance, atol=1e-6)


@pytest.mark.parametrize("mesh", [icosphere(12), box(), grid(2, 2)], ids=["fine", "coarse", "open"])
def test_a_reach_only_leaves_out_what_is_farther(rng, mesh):
    x = rng.uniform(-1.5, 1.5, (3000, 3)).astype(np.float32)
    free, limited = Projection(mesh)(x), Projection(mesh, reach=0.2)(x)
    near = np.abs(free.distance) < 0.2
    np.testing.assert_array_equal(limited.hit, near)
    for name, values in vars(limited).items():
        np.testing.assert_array_equal(values[near], getattr(free, name)[near])
    assert_consistent(mesh, x, limited)


def test_normals_that_cancel_still_give_a_direction():
    feet = Projection(box())(np.zeros((1, 3)))
    assert feet.hit.all() and abs(feet.distance[0]) > 0.4
    np.testing.assert_allclose(np.linalg.norm(feet.normal), 1, atol=1e-6)


def test_no_points_have_no_feet(ball):
    for reach in (None, 0.1):
        feet = Projection(ball, reach=reach)(np.zeros((0, 3), np.float32))
        assert feet.point.shape == (0, 3) and feet.barycentric.shape == (0, 2) and feet.hit.shape == (0,)


def test_all_points_out_of_reach_are_missed(ball):
    assert not Projection(ball, reach=0.1)(np.full((5, 3), 9, np.float32)).hit.any()


@pytest.mark.parametrize("options", [{"neighbours": 0}, {"repulsion": 0.0}, {"reach": -1.0}])
def test_numbers_out_of_range_are_refused(options):
    with pytest.raises(ConfigError):
        Projection(icosphere(2), **options)


def test_a_mesh_without_faces_is_refused():
    with pytest.raises(MeshError, match="no faces"):
        Projection(Mesh(np.zeros((3, 3)), np.zeros((0, 3), int)))


def derivatives(projection: Projection, x: np.ndarray, step: float) -> tuple[np.ndarray, np.ndarray]:
    """(N, 3, 3) d foot / d x and (N, 3) d distance / d x by central differences."""
    ahead = [projection(x + step * e) for e in np.eye(3, dtype=np.float32)]
    behind = [projection(x - step * e) for e in np.eye(3, dtype=np.float32)]
    foot = np.stack([(a.point - b.point) / (2 * step) for a, b in zip(ahead, behind, strict=True)], 2)
    distance = np.stack(
        [(a.distance - b.distance) / (2 * step) for a, b in zip(ahead, behind, strict=True)], 1
    )
    return foot, distance


def equation_2(x: np.ndarray, feet: Projections) -> tuple[np.ndarray, np.ndarray]:
    """The same derivatives by `attach`."""
    points = torch.tensor(x, requires_grad=True)
    foot, distance = attach(points, feet)
    rows = [torch.autograd.grad(foot[:, k].sum(), points, retain_graph=True)[0] for k in range(3)]
    return torch.stack(rows, 1).numpy(), torch.autograd.grad(distance.sum(), points)[0].numpy()


def test_on_a_plane_the_derivative_is_exact(rng):
    x = rng.uniform(-0.7, 0.7, (300, 3)).astype(np.float32)
    projection = Projection(grid(20, 20), repulsion=None)
    for actual, expected in zip(equation_2(x, projection(x)), derivatives(projection, x, 0.01), strict=True):
        np.testing.assert_allclose(actual, expected, atol=1e-4)


def test_on_a_sphere_the_derivative_is_right_near_the_surface(ball, rng):
    x = spread(rng, 300, 0.99, 1.01)
    projection = Projection(ball)
    actual, expected = equation_2(x, projection(x)), derivatives(projection, x, 0.05)
    np.testing.assert_allclose(actual[0], expected[0], atol=0.1)
    np.testing.assert_allclose(actual[1], expected[1], atol=0.05)


def test_the_derivative_is_equation_2_anywhere(ball, rng):
    x = spread(rng, 300, 0.3, 1.8)
    feet = Projection(ball)(x)
    foot, distance = equation_2(x, feet)
    n = feet.normal
    np.testing.assert_allclose(foot, np.eye(3) - n[:, :, None] * n[:, None, :], atol=1e-5)
    np.testing.assert_allclose(distance, n, atol=1e-6)


def test_missed_points_have_no_derivative(ball, rng):
    x = spread(rng, 300, 0.8, 1.2)
    feet = Projection(ball, reach=0.1)(x)
    foot, distance = equation_2(x, feet)
    missed = ~feet.hit
    assert 0 < missed.sum() < 300
    assert not foot[missed].any() and not distance[missed].any()
    assert foot[~missed].any() and distance[~missed].any()


def test_attached_values_are_those_of_the_feet(ball, rng):
    x = spread(rng, 50, 0.8, 1.2)
    feet = Projection(ball)(x)
    foot, distance = attach(torch.tensor(x), feet)
    np.testing.assert_array_equal(foot.numpy(), feet.point)
    np.testing.assert_array_equal(distance.numpy(), feet.distance)
