"""Base shapes of densities with known surfaces, those of the user, frames and the shell's thickness."""

from dataclasses import replace

import numpy as np
import pytest

from mitex.errors import MeshError, MeshWarning
from mitex.mesh import Mesh, grid, icosphere, quality, torus
from mitex.methods.nerf.base.base_shape import base_shape, face_frames, given_base, shell_thickness
from mitex.methods.nerf.field.projection import Projection

SIDE = 48


def places(side: int = SIDE) -> np.ndarray:
    """(3, R, R, R) centres of the cells."""
    centres = (np.arange(side) + 0.5) * 2 / side - 1
    return np.stack(np.meshgrid(centres, centres, centres, indexing="ij"))


def density(depth: np.ndarray) -> np.ndarray:
    """As a trained field has it: 10 where the depth is 0, and hundredfold within half a cell."""
    return (10 * np.exp(np.clip(200 * depth, -8, 8))).astype(np.float32)


def ball(centre: tuple[float, float, float] = (0.0, 0.0, 0.0), radius: float = 0.6) -> np.ndarray:
    return radius - np.linalg.norm(places() - np.reshape(centre, (3, 1, 1, 1)), axis=0)


@pytest.fixture(scope="module")
def packages() -> None:
    for name in ("coacd", "skimage", "pymeshlab"):
        pytest.importorskip(name)


def assert_closed_and_even(mesh: Mesh, edge: float) -> None:
    report = quality(mesh)
    assert (report.components, report.boundary_edges, report.non_manifold_edges) == (1, 0, 0)
    assert report.edge_variation < 0.15
    diagonal = np.linalg.norm(np.ptp(mesh.vertices, axis=0))
    assert report.edge_length == pytest.approx(edge * diagonal, rel=0.05)


@pytest.mark.usefixtures("packages")
def test_a_dense_ball_gives_a_ball_in_its_place():
    centre = (0.2, 0.0, -0.1)
    base = base_shape(density(ball(centre)), edge=0.02)
    assert_closed_and_even(base, 0.02)
    assert quality(base).genus == 0
    radius = np.linalg.norm(base.vertices - centre, axis=1)
    assert radius.mean() == pytest.approx(0.6, rel=0.01)
    np.testing.assert_allclose(radius, 0.6, rtol=0.03)
    assert ((base.vertices - centre) * base.normals).sum(1).min() > 0


@pytest.mark.usefixtures("packages")
def test_bumps_are_gone_and_floating_specks_too():
    bumps = 0.06 * np.prod(np.cos(16 * places()), axis=0)
    bumpy = ball() + bumps
    speck = ball((0.9, 0.9, 0.9), 0.09)
    base = base_shape(density(np.maximum(bumpy, speck)), concavity=0.4, edge=0.025)
    assert_closed_and_even(base, 0.025)
    surface = np.abs(bumpy) < 0.02
    before = np.linalg.norm(places()[:, surface], axis=0).var()
    after = np.linalg.norm(base.vertices, axis=1).var()
    assert after < before / 4
    extent = np.abs(places()[:, bumpy > 0]).max()
    np.testing.assert_allclose(np.abs(base.vertices).max(0), extent, atol=2 / SIDE)


@pytest.mark.usefixtures("packages")
def test_a_ring_keeps_its_hole():
    x, y, z = places(20)
    base = base_shape(density(0.25 - np.hypot(np.hypot(x, z) - 0.65, y)), concavity=0.3, edge=0.05)
    assert_closed_and_even(base, 0.05)
    assert quality(base).genus == 1


@pytest.mark.usefixtures("packages")
def test_a_hollow_object_is_taken_as_solid():
    solid, hollow = (
        base_shape(density(np.minimum(ball(), r)), edge=0.04) for r in (np.inf, 0.4 - ball(radius=0.6))
    )
    np.testing.assert_array_equal(solid.vertices, hollow.vertices)


@pytest.mark.parametrize(
    ("value", "message"), [(9.0, "nowhere above 10"), (np.nan, "not finite"), (np.inf, "not finite")]
)
def test_unusable_densities_are_refused(value, message):
    with pytest.raises(MeshError, match=message):
        base_shape(np.full((8, 8, 8), value, np.float32))


def test_a_given_base_that_is_fine_enough_stays():
    mesh = icosphere(60).with_vertices(0.5 * icosphere(60).vertices)
    assert given_base(mesh, 0.01) is mesh


@pytest.mark.usefixtures("packages")
def test_a_given_base_is_meshed_evenly_and_keeps_its_holes():
    coarse = icosphere(8).with_vertices(0.9 * icosphere(8).vertices)
    open_below = Mesh(coarse.vertices, coarse.faces[(coarse.vertices[coarse.faces][..., 1] > -0.5).all(1)])
    base = given_base(open_below, 0.02)
    report = quality(base)
    assert report.edge_variation < 0.2
    assert report.boundary_edges > 0 and report.euler == 1
    assert report.edge_length == pytest.approx(0.02 * np.linalg.norm(np.ptp(base.vertices, axis=0)), rel=0.15)


def test_a_given_base_that_looks_inwards_is_turned():
    mesh = torus(40, 16, 0.6, 0.25)
    uv = np.random.default_rng(0).random((len(mesh.faces), 3, 2))
    inwards = replace(mesh, faces=mesh.faces[:, ::-1], uv=uv[:, ::-1])
    with pytest.warns(MeshWarning, match="look inwards"):
        base = given_base(inwards, 0.1)
    np.testing.assert_array_equal(base.faces, mesh.faces)
    assert base.uv is not None
    np.testing.assert_allclose(base.uv, uv, atol=1e-6)


def test_a_given_base_outside_the_cube_is_refused():
    with pytest.raises(MeshError, match="scene cube"):
        given_base(torus(radius=1.0, tube=0.4))


def test_a_given_base_without_faces_is_refused():
    with pytest.raises(MeshError, match="has no faces"):
        given_base(Mesh(np.zeros((3, 3)), np.zeros((0, 3), np.int32)))


def assert_frames(mesh: Mesh, frames: np.ndarray) -> None:
    """Orthonormal, right-handed, with the face's normal."""
    assert frames.dtype == np.float32
    np.testing.assert_allclose(
        frames @ frames.transpose(0, 2, 1), np.tile(np.eye(3), (len(frames), 1, 1)), atol=1e-5
    )
    np.testing.assert_allclose(np.linalg.det(frames), 1, atol=1e-5)
    np.testing.assert_allclose(frames[:, 2], mesh.face_normals, atol=1e-6)


def test_tangents_point_where_u_grows():
    plane = grid(4, 4)
    frames = face_frames(plane)
    assert_frames(plane, frames)
    np.testing.assert_allclose(frames, np.tile(np.eye(3), (len(frames), 1, 1)), atol=1e-6)


@pytest.mark.parametrize("linear", [[[0, 1], [-1, 0]], [[-1, 0], [0, 1]], [[1, 2], [0, 3]]])
def test_tangents_follow_turned_mirrored_and_sheared_uvs(linear):
    plane = grid(4, 4)
    assert plane.uv is not None
    mesh = replace(plane, uv=plane.uv @ np.array(linear, float).T)
    frames = face_frames(mesh)
    assert_frames(mesh, frames)
    along_u = np.linalg.inv(linear)[:, 0]
    expected = np.append(along_u / np.linalg.norm(along_u), 0)
    np.testing.assert_allclose(frames[:, 0], np.tile(expected, (len(frames), 1)), atol=1e-5)


def test_frames_turn_with_the_mesh(rng):
    mesh = icosphere(6)
    mesh = replace(mesh, uv=rng.random((len(mesh.faces), 3, 2)))
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    turn *= np.sign(np.linalg.det(turn))
    turned = face_frames(mesh.with_vertices(mesh.vertices @ turn.T))
    np.testing.assert_allclose(turned, face_frames(mesh) @ turn.T, atol=1e-4)


def test_frames_without_uvs_change_slowly():
    mesh = torus()
    frames = face_frames(mesh)
    assert_frames(mesh, frames)
    both = np.sort(np.stack([mesh.faces, np.roll(mesh.faces, -1, 1)], 2).reshape(-1, 2), axis=1)
    _, edge = np.unique(both, axis=0, return_inverse=True)
    a, b = (np.argsort(edge, kind="stable") // 3).reshape(-1, 2).T
    assert np.quantile((frames[a, 0] * frames[b, 0]).sum(1), 0.02) > 0.95


def test_faces_without_area_in_uv_still_have_a_frame():
    mesh = icosphere(3)
    assert_frames(mesh, face_frames(replace(mesh, uv=np.zeros((len(mesh.faces), 3, 2)))))


def test_the_shell_is_twice_the_distance_of_most_points(rng):
    x = np.column_stack([rng.uniform(-0.8, 0.8, (1000, 2)), np.linspace(-0.1, 0.1, 1000)])
    thickness = shell_thickness(x, Projection(grid(20, 20), repulsion=None))
    assert thickness == pytest.approx(2 * 0.07, rel=0.01)


def test_a_scan_elsewhere_is_refused():
    with pytest.raises(MeshError, match="no point of the scan"):
        shell_thickness(np.full((5, 3), 3.0), Projection(grid(4, 4), repulsion=None))
