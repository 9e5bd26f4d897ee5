"""Pages of assets: what they show is what the textures, or the vertices, hold."""

from dataclasses import replace

import numpy as np
import pytest
from scipy.ndimage import uniform_filter

from mitex.asset import Asset, clay
from mitex.export import SUFFIXES
from mitex.export.common import default_tangents
from mitex.geometry.vectors import unit
from mitex.mesh import grid, icosphere, torus


@pytest.fixture(scope="module")
def asset():
    mesh = torus(24, 12)
    ramp = 0.5 + 0.3 * mesh.vertices
    normal = np.broadcast_to(np.array([0.7, 0.5, 0.9], np.float32), mesh.vertices.shape)
    maps = {"albedo": ramp, "roughness": ramp[:, :1], "height": ramp[:, 1:2], "normal": normal}
    return Asset(mesh, maps, default_tangents(mesh), name="a torus")


@pytest.mark.parametrize("resolution", [0, 256])
def test_pixels_have_the_assets_values(browser, asset, resolution, tmp_path):
    path = (asset.baked(resolution) if resolution else asset).export(tmp_path / "torus.html")
    tab = browser.open(path, 64)
    colour, bent, plain, spot, ids = tab.maps()
    hit = ids[..., 0] > 0
    mesh = asset.mesh
    face, bits = ids[hit][:, 0].astype(int) - 1, ids[hit][:, 1:3].copy().view(np.float32)
    weights = np.column_stack([bits, 1 - bits.sum(1)])[..., None]
    at = {name: (weights * values[mesh.faces[face]]).sum(1) for name, values in asset.vertex_maps.items()}
    detail = unit((weights * asset.detail_normals()[mesh.faces[face]]).sum(1))
    assert np.abs(colour[hit][:, :3] - at["albedo"]).mean() < 0.01
    assert np.abs(colour[hit][:, 3:] - at["height"]).mean() < 0.01
    assert np.abs(bent[hit][:, 3:] - at["roughness"]).mean() < 0.01
    assert ((bent[hit][:, :3] * detail).sum(1) > 0.99).mean() > 0.95
    assert plain[hit][:, 3].min() > 0.97
    assert tab.picture().std() > 0.02 and tab.errors == []


def test_a_page_is_one_of_the_formats(asset, tmp_path):
    assert ".html" in SUFFIXES
    text = replace(asset, name="<b>").export(tmp_path / "torus.html").read_text()
    assert "<title>&lt;b&gt;</title>" in text


def lit(tab, azimuth):
    """The picture in the light from a side [degrees]."""
    tab.run("page.studio.camera.azimuth = argument * Math.PI / 180; page.studio.camera.fit()", azimuth)
    return tab.picture()


def test_faces_are_lit_on_both_sides(browser, tmp_path):
    """The studio's light turns with the camera: a square looks the same from in front and from behind."""
    tab = browser.open(clay(grid(4, 4)).export(tmp_path / "square.html"), 64)
    front, behind = lit(tab, 0), lit(tab, 180)
    assert front.std() > 0.02 and np.abs(front - behind).mean() < 0.01


def test_outlines_of_coarse_meshes_have_no_specks(browser, tmp_path):
    """There the smooth normal points away from the eye, though the face does not."""
    tab = browser.open(clay(icosphere(2)).export(tmp_path / "ball.html"), 128)
    picture = tab.picture().mean(axis=2)
    _, _, plain, spot, ids = (values[::-1] for values in tab.maps())
    eye = np.array(tab.run("return page.studio.camera.eye"))
    hit = ids[..., 0] > 0
    away = hit & (((eye - spot[..., :3]) * plain[..., :3]).sum(-1) < 0)
    around = uniform_filter(picture * hit, 9) / np.maximum(uniform_filter(hit.astype(float), 9), 1e-9)
    assert away.sum() > 20 and np.abs(picture - around)[away].max() < 0.1
