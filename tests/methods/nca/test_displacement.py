"""Reliefs: their normals, the maps that tell them, and meshes that they move."""

from typing import Any

import numpy as np
import pytest
import torch

from mitex.atlas import Atlas
from mitex.errors import ConfigError
from mitex.geometry.vectors import unit
from mitex.mesh import Mesh, grid, icosphere
from mitex.methods.nca import NcaTexture
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.displacement import Displacement, known_relief
from mitex.methods.nca.embossed import EmbossedTexture
from mitex.methods.nca.film import FilmSettings, PreviewCamera
from mitex.methods.nca.growth import LookGrowth
from mitex.render.preview import PreviewRenderer
from tests.methods.nca.tiny import texture

EDGE = 0.1


@pytest.fixture(scope="module")
def plate():
    """A flat square with edges of about 0.1."""
    mesh = grid(20, 20)
    lengths = mesh.edge_lengths.mean()
    return mesh.with_vertices(mesh.vertices * (EDGE / lengths))


def _ramp(mesh, slope):
    """Heights (V,) that rise along x."""
    return torch.from_numpy(0.5 + slope * mesh.vertices[:, 0])


def test_offsets_end_at_the_bound():
    relief = Displacement(icosphere(6), 2.0)
    edges = icosphere(6).edges
    points = icosphere(6).vertices
    mean = np.linalg.norm(points[edges.indices] - points[edges.rows], axis=1).mean()
    offsets = relief.offsets(torch.tensor([0.5, 1.0, 0.0, 3.0, -1.0, 0.75]))
    assert np.allclose(offsets, 2 * mean * np.array([0, 1, -1, 1, -1, 0.5]), atol=1e-6)


def test_the_normals_of_a_ramp(plate):
    relief = Displacement(plate, 2.0)
    normals = relief.normals(_ramp(plate, 0.05)).numpy()
    steep = relief.bound * 2 * 0.05
    assert np.allclose(normals, unit(plate.normals - [steep, 0, 0]), atol=1e-4)


def test_the_normals_are_those_of_the_moved_mesh():
    """But for what the curvature of the sphere adds, and for the size of its faces."""
    mesh = icosphere(24)
    height = torch.from_numpy(0.5 + 0.2 * np.sin(4 * mesh.vertices).prod(axis=1))
    relief = Displacement(mesh, 1.0)
    moved = mesh.with_vertices(mesh.vertices + relief.offsets(height)[:, None].numpy() * mesh.normals)
    cosine = (moved.normals * relief.normals(height).numpy()).sum(axis=1)
    tilt = (moved.normals * mesh.normals).sum(axis=1)
    assert np.degrees(np.arccos(cosine.clip(max=1))).max() < 0.06 * np.degrees(np.arccos(tilt.min()))


def test_gradients_by_finite_differences():
    mesh = icosphere(4)
    relief, generator = Displacement(mesh, 2.0), torch.Generator().manual_seed(0)
    height, weights = torch.rand(162, generator=generator), torch.rand(162, 3, generator=generator)
    step = torch.randn(162, generator=generator)
    (slope,) = torch.autograd.grad(
        (relief.normals(height + (scale := torch.zeros((), requires_grad=True)) * step) * weights).sum(),
        scale,
    )
    up, down = ((relief.normals(height + s * step) * weights).sum() for s in (1e-3, -1e-3))
    assert slope.item() == pytest.approx(((up - down) / 2e-3).item(), rel=0.02)


@pytest.mark.parametrize(
    ("about", "maps", "bound"),
    [
        ({"relief": 2}, ["height"], 2.0),
        ({"relief": 2}, ["albedo"], 0.0),
        ({"relief": -1}, ["height"], 0.0),
        ({"relief": "much"}, ["height"], 0.0),
        ({}, ["height"], 0.0),
    ],
)
def test_what_a_file_tells_of_a_relief(about, maps, bound):
    assert known_relief(about, maps) == bound


def _ramp_state(mesh, slope):
    """Of a look without a decoder, whose height is a channel: heights as of `_ramp`."""
    state = torch.zeros(len(mesh.vertices), 16)
    state[:, 6] = _ramp(mesh, slope) - 0.5
    return state


def _embossed(mesh: Mesh, moved: bool) -> EmbossedTexture:
    look = texture(("albedo", "height"), shape=None).look
    growth = LookGrowth(look, Cells(mesh, 0, mesh), relief=2.0)
    shown = (growth.displaced() if moved else growth).texture(_ramp_state(mesh, 0.05))
    assert isinstance(shown, EmbossedTexture)
    return shown


def test_a_relief_is_a_normal_map(plate):
    shown = _embossed(plate, moved=False)
    asset, steep = shown.asset(), Displacement(plate, 2.0).bound * 0.1
    assert np.array_equal(asset.mesh.vertices, plate.vertices)
    assert np.allclose(asset.detail_normals(), unit(plate.normals - [steep, 0, 0]), atol=2e-3)
    atlas = Atlas.build(plate, 64)
    normal = shown.textures(atlas)["normal"]
    tilt = 2 * normal[atlas.inside][:, 2] - 1
    assert np.allclose(tilt, 1 / np.hypot(1, steep), atol=5e-3)


def test_a_film_shows_the_relief(plate):
    """By the normals, in the light of the preview; not at all where the relief is of height 0."""
    settings = FilmSettings(resolution=32, azimuth=50.0)
    camera, look = PreviewCamera(plate, settings), texture(("albedo", "height"), shape=None).look
    renderer = PreviewRenderer(plate, resolution=32, azimuth=50.0, elevation=settings.elevation)
    pictures = []
    for relief in (0.0, 20.0, 50.0):
        growth = LookGrowth(look, Cells(plate, 0, plate), relief=relief)
        pictures.append(camera.picture(growth.texture(_ramp_state(plate, 0.2))))
        steep = Displacement(plate, relief).bound * 0.4
        normals = np.tile(unit(np.array([[-steep, 0, 1]])), (len(renderer.face), 1)).astype(np.float32)
        expected = renderer.render(np.full((len(normals), 3), 0.5, np.float32), normals, 1.0)
        assert np.allclose(pictures[-1], expected, atol=1e-3)
    assert np.abs(pictures[0] - pictures[1]).max() > 0.03 < np.abs(pictures[1] - pictures[2]).max()


def test_a_moved_mesh_has_the_relief_in_its_shape(plate):
    """And an even normal map, where it has a vertex for each cell."""
    asset = _embossed(plate, moved=True).asset()
    steep = Displacement(plate, 2.0).bound * 0.1
    expected = plate.vertices + steep * plate.vertices[:, :1] * plate.normals
    assert np.allclose(asset.mesh.vertices, expected, atol=1e-6)
    assert np.allclose(asset.vertex_maps["normal"], [0.5, 0.5, 1.0], atol=5e-3)


def test_textures_with_and_without_a_relief():
    words = texture(("albedo", "height"))
    words = NcaTexture(words.look, {"name": "words", "relief": 2.0})
    sphere = icosphere(6)
    options: dict[str, Any] = {"resolution": 64, "steps": 4, "subdivide": 0}
    plain, moved = words.apply(sphere, **options), words.apply(sphere, displace=True, **options)
    assert set(plain.maps) == set(plain.vertex_maps) == {"albedo", "height", "normal"}
    assert np.array_equal(plain.mesh.vertices, sphere.vertices)
    offsets = np.linalg.norm(moved.mesh.vertices, axis=1) - 1
    bound = Displacement(sphere, 2.0).bound
    assert 0.001 < np.abs(offsets).max() <= bound * 1.001
    still = texture(("albedo", "height"))
    assert set(still.apply(sphere, **options).maps) == {"albedo", "height"}
    with pytest.raises(ConfigError, match="no relief that could displace"):
        still.apply(sphere, displace=True, **options)
