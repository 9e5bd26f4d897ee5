"""Height maps against surfaces whose heights are known."""

from dataclasses import replace

import numpy as np
import pytest

from mitex.errors import CheckpointError, ConfigError
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.baselines.displacement import DisplacementConfig, DisplacementMap, fit
from mitex.methods.geometric.references import knobs

WINDOW = DisplacementConfig().window


def waves(count: int = 240) -> Mesh:
    """A square of side 1 with waves along x, whose length is a fifth of the window."""
    flat = grid(count, count)
    points = flat.vertices / np.ptp(flat.vertices, axis=0).max()
    points = points - points.mean(0)
    points[:, 2] = 0.01 * np.cos(2 * np.pi * 5 * points[:, 0] / WINDOW)
    return Mesh(points, flat.faces, name="waves")


def test_heights_of_waves():
    reference = waves()
    baked = DisplacementMap.bake(reference, 100)
    area = reference.face_areas.sum()
    x = (np.arange(100) + 0.5) / 100 - 0.5
    expected = 0.01 * np.cos(2 * np.pi * 5 * x) / np.sqrt(area)
    assert baked.side * np.sqrt(area) == pytest.approx(WINDOW, rel=1e-5)
    # A quadric takes a little of the waves along.
    assert np.abs(baked.heights - expected).max() < 0.1 * expected.max()
    assert np.abs(baked.heights.std(0)).max() < 0.05 * expected.max()


def test_a_ball_is_nearly_flat():
    """What is left of its depth in the window is of fourth order."""
    heights = DisplacementMap.bake(icosphere(48)).heights
    assert np.abs(heights).max() < 2e-3


def test_vertices_move_along_their_normals_only():
    ball = icosphere(8)
    moved = DisplacementMap.bake(knobs()).apply(ball, scale=1.5, subdivide=1).mesh
    assert len(moved.faces) == 4 * len(ball.faces)
    still = DisplacementMap(np.zeros((8, 8)), 0.2).apply(ball, subdivide=1).mesh
    way = moved.vertices - still.vertices
    along = (way * still.normals).sum(1, keepdims=True) * still.normals
    assert np.abs(way - along).max() < 1e-6
    assert np.abs(way).max() > 0.02


def test_sizes_follow_the_mesh():
    """A mesh eight times as large gets heights eight times as large, in the same places."""
    ball = icosphere(8)
    baked = DisplacementMap.bake(waves(), 64)
    small = baked.apply(ball).mesh.vertices
    large = baked.apply(ball.with_vertices(8 * ball.vertices)).mesh.vertices
    assert np.abs(large - 8 * small).max() < 1e-3


def test_a_map_repeats_in_mirrored_squares():
    """A plane of side 1 with UVs of side 1, and a map half as wide that rises along x."""
    flat = grid(64, 64)
    points = (flat.vertices - flat.vertices.min(0)) / np.ptp(flat.vertices, axis=0).max()
    plane = replace(Mesh(points, flat.faces), uv=points[flat.faces][..., :2])
    ramp = np.tile((np.arange(32) + 0.5) / 32, (32, 1)) * 0.1
    height = DisplacementMap(ramp, 0.5).apply(plane).mesh.vertices[:, 2]
    x = points[:, 0]
    expected = 0.1 * np.where(x < 0.5, x, 1 - x) / 0.5
    inner = (x > 0.05) & (x < 0.95) & (np.abs(x - 0.5) > 0.05)
    assert np.abs(height - expected)[inner].max() < 1e-3


def test_refuses_holes():
    frame = grid(8, 8)
    middle = np.abs(frame.vertices[frame.faces].mean(1) - frame.vertices.mean(0)).max(1)
    hole = Mesh(frame.vertices, frame.faces[middle > 0.3 * np.ptp(frame.vertices)], name="hole")
    with pytest.raises(ConfigError, match="has holes"):
        DisplacementMap.bake(hole)


@pytest.mark.parametrize("options", [{"scale": 0.0}, {"scale": np.nan}, {"subdivide": -1}, {"subdivide": 7}])
def test_refuses_numbers_out_of_range(options):
    with pytest.raises(ConfigError, match=f"`{next(iter(options))}` .* is out of range"):
        DisplacementMap(np.zeros((8, 8)), 0.2).apply(icosphere(2), **options)


def test_a_fit_is_kept_and_its_settings_count(tmp_path):
    baked = fit(waves(), tmp_path / "run", set=["resolution=32", "window=0.2"])
    again = DisplacementMap.load(tmp_path / "run")
    assert np.array_equal(again.heights, baked.heights) and again.heights.shape == (32, 32)
    assert again.side == pytest.approx(0.2 / np.sqrt(waves().face_areas.sum()), rel=1e-5)
    assert again.about["name"] == "waves" and again.about["preset"] == "default"
    ball = icosphere(4)
    assert np.array_equal(again.apply(ball).mesh.vertices, baked.apply(ball).mesh.vertices)


@pytest.mark.parametrize(
    ("heights", "side", "message"),
    [
        (np.zeros((4, 5)), 0.2, "heights of shape"),
        (np.full((4, 4), np.nan), 0.2, "not finite"),
        (np.zeros((4, 4)), 0.0, "without a side"),
    ],
)
def test_damaged_files_are_refused(heights, side, message, tmp_path):
    damaged = DisplacementMap(heights, side, {"name": "flat"}).save(tmp_path / "flat.safetensors")
    with pytest.raises(CheckpointError, match=message):
        DisplacementMap.load(damaged)
