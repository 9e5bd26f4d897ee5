"""scenes/render_asset.py runs, and its grooves have the relief that their height says."""

import importlib.util
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from mitex.asset import Asset
from mitex.images import read_image

SCRIPT = Path(__file__).parents[2] / "scenes" / "render_asset.py"


@pytest.fixture
def script(tmp_path, monkeypatch) -> Any:
    spec = importlib.util.spec_from_file_location("render_asset_script", SCRIPT)
    assert spec is not None and spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    monkeypatch.chdir(tmp_path)
    return module


def test_pictures_from_maps_and_from_the_file_agree(script, tmp_path, monkeypatch):
    large = Asset.baked
    monkeypatch.setattr(Asset, "baked", lambda self, resolution: large(self, resolution // 4))
    script.main(resolution=48, spp=16)
    first = read_image(tmp_path / "asset.png")
    script.main("vase.glb", resolution=48, spp=16)
    assert np.abs(first - read_image(tmp_path / "asset.png")).mean() < 0.01
    assert np.ptp(first[16:32, 16:32]) > 0.3


def test_normals_lean_away_from_where_the_height_grows(script):
    asset = script.grooved()
    a, b = asset.mesh.vertices[asset.mesh.faces[:, 0]], asset.mesh.vertices[asset.mesh.faces[:, 1]]
    detail = asset.detail_normals() - asset.mesh.normals
    height = asset.vertex_maps["height"][:, 0]
    rise = height[asset.mesh.faces[:, 1]] - height[asset.mesh.faces[:, 0]]
    lean = ((b - a) * (detail[asset.mesh.faces[:, 0]] + detail[asset.mesh.faces[:, 1]])).sum(axis=1)
    assert np.corrcoef(rise, lean)[0, 1] < -0.8
