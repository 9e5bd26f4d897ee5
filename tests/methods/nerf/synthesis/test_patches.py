"""Patches on surfaces whose points are known."""

from typing import Any

import numpy as np
import pytest

from mitex.errors import ConfigError, MeshError
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.nerf.synthesis.patches import (
    FeatureSource,
    Patches,
    extract_patches,
    mirror_frames,
    principal_direction,
    spread_points,
)
from mitex.quilting.matching import ArraySource
from mitex.quilting.plane import quilt

TURN = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
TURN *= np.linalg.det(TURN)


def plane(turn: np.ndarray = TURN, cells: int = 24, height: float = 0.0) -> Mesh:
    """A square of side 1.6, x and y along the first rows of `turn`."""
    flat = grid(cells, cells)
    points = flat.vertices.astype(np.float64) * 0.8 + (0.0, 0.0, height)
    return Mesh(points @ turn, flat.faces, name="plane")


def joined(*meshes: Mesh) -> Mesh:
    firsts = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    faces = [m.faces + first for m, first in zip(meshes, firsts, strict=False)]
    return Mesh(np.concatenate([m.vertices for m in meshes]), np.concatenate(faces))


def expected_plane(patches: Patches) -> np.ndarray:
    """(P, S, S, 3) texels of the tangent planes: columns along x, rows against y."""
    size = patches.points.shape[1]
    place = patches.gap * (np.arange(size) - 0.5 * (size - 1))
    x, y = (patches.frames[:, None, None, k] for k in (0, 1))
    return patches.centres[:, None, None] + place[None, None, :, None] * x - place[None, :, None, None] * y


def test_plane_gives_exact_squares(rng: np.random.Generator):
    mesh = plane()
    patches = extract_patches(mesh, rng, count=60, size=16, pattern_rate=0.2)
    assert 20 < len(patches) <= 60
    corners = mesh.vertices[mesh.faces]
    edge = 0.8 * 2.0 / 24  # horizontal and vertical ones; per cell, one diagonal
    borders = 2 * 24 * 25
    mean = edge * (borders + np.sqrt(2.0) * 24**2) / (borders + 24**2)
    assert patches.gap == pytest.approx(0.2 * mean, rel=1e-5)
    assert patches.length == pytest.approx(16 * patches.gap)
    assert np.abs(patches.points - expected_plane(patches)).max() < 2e-6
    # Every point is in its face.
    a, b, c = (corners[patches.faces][..., k, :] for k in range(3))
    for p, q in ((a, b), (b, c), (c, a)):
        assert (np.cross(q - p, patches.points - p) @ TURN[2]).min() > -1e-5


def test_frames_are_right_handed_and_alike(rng: np.random.Generator):
    direction = TURN[0] + 2.0 * TURN[1] + 5.0 * TURN[2]
    patches = extract_patches(plane(), rng, count=40, size=16, pattern_rate=0.2, direction=direction)
    x = (TURN[0] + 2.0 * TURN[1]) / np.sqrt(5.0)
    assert np.abs(patches.frames - np.stack([x, np.cross(TURN[2], x), TURN[2]])).max() < 1e-5
    assert np.linalg.det(patches.frames) == pytest.approx(1.0, abs=1e-5)


def test_default_direction_is_the_longest(rng: np.random.Generator):
    ball = icosphere(12)
    long = ball.with_vertices(ball.vertices * (0.3, 0.8, 0.4) @ TURN)
    axis = principal_direction(long)
    assert abs(axis @ TURN[1]) == pytest.approx(1.0, abs=1e-3) and axis[np.abs(axis).argmax()] > 0.0
    patches = extract_patches(long, rng, count=40, size=8, pattern_rate=0.1)
    x, y, _ = patches.frames.swapaxes(0, 1)
    assert (x @ axis).min() > 0.0
    assert np.abs(y @ axis).max() < 1e-5


def test_ball_gives_the_rays_hits(rng: np.random.Generator):
    """A ray along -z meets a sphere of radius r at height sqrt(r^2 - x^2 - y^2) over its middle."""
    mesh = icosphere(48)
    mesh = mesh.with_vertices(0.8 * mesh.vertices)
    patches = extract_patches(mesh, rng, count=50, size=32)
    assert len(patches) > 40
    below = expected_plane(patches)
    z = patches.frames[:, None, None, 2]
    along = (below * z).sum(-1, keepdims=True)
    across = np.square(below - along * z).sum(-1, keepdims=True)
    hits = below + (np.sqrt(0.64 - across) - along) * z
    sagitta = 0.8 - np.linalg.norm(mesh.vertices[mesh.faces].mean(1), axis=1).min()
    assert np.abs(patches.points - hits).max() < 1.5 * sagitta < 2e-4
    lateral = patches.points - below
    assert np.abs(lateral - (lateral * z).sum(-1, keepdims=True) * z).max() < 2e-6


def test_patches_stay_inside_the_border(rng: np.random.Generator):
    patches = extract_patches(plane(), rng, count=200, size=16, pattern_rate=0.5)
    assert 0 < len(patches) < 150
    assert np.abs(patches.points @ TURN.T[:, :2]).max() <= 0.8 + 1e-5
    assert np.abs(patches.centres @ TURN.T[:, :2]).max() < 0.8 - 0.49 * patches.length


def test_no_patch_crosses_a_ledge(rng: np.random.Generator):
    """A second sheet 0.05 over the first, over its left half only."""
    upper = plane(np.eye(3), height=0.05)
    upper = Mesh(upper.vertices * (0.5, 1.0, 1.0) - (0.4, 0.0, 0.0), upper.faces)
    mesh = joined(plane(np.eye(3)), upper)
    patches = extract_patches(mesh, rng, count=300, size=16, pattern_rate=0.1)
    heights = patches.points[..., 2].reshape(len(patches), -1)
    assert np.ptp(heights, axis=1).max() < 1e-5
    assert 0.0 < heights[:, 0].mean() < 0.05  # there are some on either


def test_undersides_make_no_patch(rng: np.random.Generator):
    upper = plane(np.eye(3), height=0.05)
    mesh = joined(plane(np.eye(3)), Mesh(upper.vertices, upper.faces[:, ::-1]))
    with pytest.raises(
        ConfigError, match=r"none fits on mesh: \d+ reach past its border, \d+ bend or fold; use"
    ):
        extract_patches(mesh, rng, count=50, size=16, pattern_rate=0.2)


def test_steep_walls_make_no_patch(rng: np.random.Generator):
    """A roof of 30 degrees is allowed, one of 80 is not."""
    for slope, allowed in ((30.0, True), (80.0, False)):
        flat = plane(np.eye(3), cells=80).vertices
        rise = np.tan(np.radians(slope)) * np.maximum(flat[:, 0] - 0.2, 0.0)
        roof = Mesh(flat + rise[:, None] * np.eye(3)[2], plane(np.eye(3), cells=80).faces)
        patches = extract_patches(roof, rng, count=300, size=16, pattern_rate=0.5, direction=np.eye(3)[0])
        x = patches.points[patches.frames[:, 2, 2] > 0.99][..., 0].reshape(-1, 256)
        crossing = (x.min(1) < 0.19) & (x.max(1) > 0.21)
        assert crossing.any() == allowed


def test_balls_bend_away_from_large_squares(rng: np.random.Generator):
    """The corners of a square of side a are r - sqrt(r^2 - a^2 / 2) below its middle: 0.08, or 0.17."""
    mesh = icosphere(24)
    mesh = mesh.with_vertices(0.8 * mesh.vertices)
    rate = 1.0 / extract_patches(mesh, rng, count=9, size=32, pattern_rate=0.1).length * 0.1
    assert len(extract_patches(mesh, rng, count=30, size=32, pattern_rate=0.5 * rate)) > 20
    with pytest.raises(ConfigError, match=r"on icosphere24: \d+ bend or fold; use"):
        extract_patches(mesh, rng, count=30, size=32, pattern_rate=0.7 * rate)


def test_only_captured_places(rng: np.random.Generator):
    u, v = np.meshgrid(np.linspace(-0.8, 0.0, 60), np.linspace(-0.8, 0.8, 120))
    scan = np.stack([u.ravel(), v.ravel(), np.full(u.size, 0.01)], 1)
    for thickness, reach in ((0.02, 0.06), (1.0, 0.1)):
        patches = extract_patches(
            plane(np.eye(3)), rng, count=300, size=16, pattern_rate=0.2, scan=scan, thickness=thickness
        )
        assert reach - 0.03 < patches.points[..., 0].max() < reach + 2.0 * patches.gap
    with pytest.raises(ConfigError, match="off the captured surface; use a smaller"):
        extract_patches(plane(np.eye(3)), rng, count=20, size=16, scan=scan + 1.0)


def test_spread_points_are_apart_and_even(rng: np.random.Generator):
    mesh = joined(plane(np.eye(3), 2), plane(np.eye(3), 30, height=5.0))  # equal areas, unequal faces
    points, faces = spread_points(mesh, 400, rng)
    assert 350 < len(points) <= 400 and points.dtype == np.float32
    distance = np.linalg.norm(points[:, None] - points, axis=-1) + 9.0 * np.eye(len(points))
    assert distance.min() > 0.9 * np.sqrt(0.6 * 5.12 / 400)
    assert 0.45 < (points[:, 2] < 1.0).mean() < 0.55
    assert ((faces < 8) == (points[:, 2] < 1.0)).all()


def test_same_seed_same_patches():
    a, b = (extract_patches(plane(), np.random.default_rng(5), count=20, size=8) for _ in range(2))
    assert (a.points == b.points).all() and (a.faces == b.faces).all()


def test_features_come_when_asked(rng: np.random.Generator):
    patches = extract_patches(plane(), rng, count=10, size=8)
    counts = []

    def features(points: np.ndarray) -> np.ndarray:
        counts.append(len(points))
        return points @ np.arange(12.0).reshape(3, 4)

    source = FeatureSource(patches, features, matched=2)
    assert not counts
    assert np.allclose(source.patch(3), patches.points[3] @ np.arange(12.0).reshape(3, 4))
    assert counts == [64] and source.length == patches.length


@pytest.mark.parametrize("flip", [0, 1, 2, 3])
def test_mirrored_bumps_have_mirrored_normals(flip: int, rng: np.random.Generator):
    """Equation 4, with T_s of the mirrored patch, against differences of the mirrored heights."""
    patches = extract_patches(plane(), rng, count=10, size=32, pattern_rate=0.1)

    def height_and_normal(points: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
        u, v = points @ TURN[0], points @ TURN[1]
        height = 0.05 * np.sin(4.0 * u + 1.0) * np.cos(3.0 * v) + 0.02 * u
        du = 0.2 * np.cos(4.0 * u + 1.0) * np.cos(3.0 * v) + 0.02
        dv = -0.15 * np.sin(4.0 * u + 1.0) * np.sin(3.0 * v)
        normal = TURN[2] - du[..., None] * TURN[0] - dv[..., None] * TURN[1]
        return height, normal / np.linalg.norm(normal, axis=-1, keepdims=True)

    heights, normals = height_and_normal(patches.points.astype(np.float64))
    source = ArraySource(heights[..., None].astype(np.float32), patches.centres, patches.length)
    texture = next(q for _ in range(99) if (q := quilt(source, (32, 32), rng, flips=True)).flip[0, 0] == flip)
    # What the field stores: angles in a frame of the face, here of any turn.
    tangent = np.cos(1.0) * TURN[0] + np.sin(1.0) * TURN[1]
    captured_frame = np.stack([tangent, np.cross(TURN[2], tangent), TURN[2]])
    stored = texture.look_up(normals) @ captured_frame.T
    sampled = patches.frames[texture.patch[0, :1]]
    target = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    target *= np.linalg.det(target)

    def transferred(sampling: np.ndarray) -> np.ndarray:
        return stored @ captured_frame @ sampling.T @ target

    heightmap = texture.features[..., 0].astype(np.float64)
    drop, along = (np.asarray(np.gradient(heightmap, patches.gap, axis=k)) for k in (0, 1))
    expected = target[2] - along[..., None] * target[0] + drop[..., None] * target[1]
    expected /= np.linalg.norm(expected, axis=-1, keepdims=True)
    inner = slice(1, -1), slice(1, -1)
    frame = mirror_frames(sampled, texture.flip[0, :1])[0]
    assert (transferred(frame) * expected).sum(-1)[inner].min() > 1.0 - 1e-5
    if flip:
        assert (transferred(sampled[0]) * expected).sum(-1)[inner].min() < 1.0 - 1e-3


def test_mirrored_frames_turn_around_the_axis_that_is_mirrored():
    frames = np.broadcast_to(TURN, (4, 3, 3))
    signs = [[1, 1, 1], [-1, 1, 1], [1, -1, 1], [-1, -1, 1]]
    assert np.allclose(mirror_frames(frames, np.arange(4)), np.array(signs)[:, :, None] * TURN)


def test_refusals(rng: np.random.Generator):
    mesh = plane()
    options: list[dict[str, Any]] = [
        {"count": 0},
        {"size": 12},
        {"size": 0},
        {"pattern_rate": 0.0},
        {"pattern_rate": np.nan},
        {"thickness": -1.0},
        {"direction": np.zeros(3)},
        {"direction": np.array([1.0, np.nan, 0.0])},
        {"direction": np.ones(2)},
    ]
    for wrong in options:
        with pytest.raises(ConfigError):
            extract_patches(mesh, rng, **wrong)
    with pytest.raises(ConfigError, match="reach past its border; use a smaller pattern rate"):
        extract_patches(mesh, rng, count=20, pattern_rate=1.0)
    empty = Mesh(np.zeros((3, 3)), np.array([[0, 1, 2]]))
    with pytest.raises(MeshError):
        extract_patches(empty, rng)
