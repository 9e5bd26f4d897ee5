"""Pages of assets: what they show is what the textures, or the vertices, hold."""

from dataclasses import replace

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.export import SUFFIXES
from mitex.export.common import default_tangents
from mitex.geometry.vectors import unit
from mitex.mesh import torus


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
