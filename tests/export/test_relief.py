"""Height maps as geometry: known heights on a plane, closed surfaces, and what is refused."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.atlas import Atlas
from mitex.errors import ConfigError
from mitex.export import embossed, read_glb
from mitex.mesh import Mesh, grid, icosphere

SIDE = 64


def textured(mesh: Mesh, height: np.ndarray, **maps: np.ndarray) -> Asset:
    """A mesh on a layout of its own with a height map (N, N)."""
    atlas = Atlas.build(mesh, len(height), 4)
    grey = np.full((len(mesh.vertices), 1), 0.5, np.float32)
    textures = {"height": height[..., None].astype(np.float32), **maps}
    vertex_maps = {name: np.repeat(grey, values.shape[2], 1) for name, values in textures.items()}
    return Asset(mesh, vertex_maps, np.full((len(grey), 3), 3**-0.5), atlas, textures, "part")


def plane() -> Mesh:
    """The square [0, 1]^2 with itself as its layout."""
    mesh = grid(4, 4)
    low, size = mesh.vertices.min(0), np.ptp(mesh.vertices, axis=0).max()
    mesh = mesh.with_vertices((mesh.vertices - low) / size)
    return replace(mesh, uv=mesh.vertices[mesh.faces][..., :2])


def wave() -> np.ndarray:
    u = (np.arange(SIDE) + 0.5) / SIDE
    return np.broadcast_to(0.5 + 0.5 * np.sin(2 * np.pi * u), (SIDE, SIDE))


def test_a_wave_on_a_plane():
    mesh = plane()
    albedo = np.full((SIDE, SIDE, 3), (0.2, 0.4, 0.6), np.float32)
    asset = embossed(textured(mesh, wave(), albedo=albedo), 0.3)
    points = asset.mesh.vertices
    radius = mesh.normalised()[1].scale
    inside = (points[:, 0] > 0.05) & (points[:, 0] < 0.95)
    expected = 0.3 * radius * 0.5 * np.sin(2 * np.pi * points[:, 0])
    np.testing.assert_allclose(points[inside, 2], expected[inside], atol=0.02 * radius * 0.3)
    assert len(asset.mesh.faces) > 16 * len(mesh.faces)
    assert set(asset.maps) == {"albedo"}
    np.testing.assert_allclose(asset.vertex_maps["albedo"], np.broadcast_to((0.2, 0.4, 0.6), points.shape))


def test_depth_is_a_factor_and_its_sign_turns_the_relief():
    asset = textured(plane(), wave())
    up, down, none = (embossed(asset, depth).mesh.vertices for depth in (0.2, -0.2, 0.0))
    np.testing.assert_allclose(up - none, none - down, atol=1e-6)
    assert np.ptp(up[:, 2]) > 0.1 and np.ptp(none[:, 2]) == 0


def test_the_surface_stays_closed_over_seams():
    """Random heights differ on the sides of a seam; a ball has no border all the same."""
    rng = np.random.default_rng(0)
    ball = icosphere(4)
    asset = embossed(textured(ball, rng.random((256, 256))), 0.1, faces=20_000)
    edges = np.sort(asset.mesh.faces[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)
    assert (np.unique(edges, axis=0, return_counts=True)[1] == 2).all()
    assert 5_000 <= len(asset.mesh.faces) <= 40_000
    assert np.ptp(np.linalg.norm(asset.mesh.vertices, axis=1)) > 0.01


def test_a_level_height_leaves_the_shape():
    ball = icosphere(8)
    asset = embossed(textured(ball, np.full((SIDE, SIDE), 0.7)), 0.4)
    np.testing.assert_allclose(asset.mesh.vertices[: len(ball.vertices)], ball.vertices, atol=1e-5)


def test_faces_are_no_finer_than_texels():
    assert len(embossed(textured(plane(), wave()), 0.1).mesh.faces) <= 4 * 2 * SIDE**2
    fine = grid(100, 100)
    assert len(embossed(textured(fine, wave()), 0.1).mesh.faces) == len(fine.faces)


def test_vertex_maps_are_baked_first():
    asset = textured(plane(), wave())
    at_vertices = Asset(asset.mesh, {"height": asset.mesh.vertices[:, :1]}, name="part")
    points = embossed(at_vertices, 0.3, faces=10_000).mesh.vertices
    assert np.corrcoef(points[:, 0], points[:, 2])[0, 1] > 0.99


def test_it_is_written_as_geometry(tmp_path):
    asset = embossed(textured(plane(), wave()), 0.3)
    read = read_glb(asset.export(tmp_path / "relief.glb"))
    assert np.ptp(read.mesh.vertices[:, 2]) == pytest.approx(np.ptp(asset.mesh.vertices[:, 2]), rel=1e-4)


@pytest.mark.parametrize(("depth", "message"), [(0.6, "a relief of 0.6 radii"), (np.nan, "a relief of nan")])
def test_depths_out_of_range(depth, message):
    with pytest.raises(ConfigError, match=message):
        embossed(textured(plane(), wave()), depth)


def test_without_heights():
    flat = Asset(plane(), {"roughness": np.zeros((25, 1), np.float32)})
    with pytest.raises(ConfigError, match="no height map; it has roughness"):
        embossed(flat, 0.1)
