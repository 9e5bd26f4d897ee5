"""The example scripts in scenes/ run and make their pictures."""

import importlib.util
from pathlib import Path

import pytest

from mitex.images import read_image

SCRIPTS = Path(__file__).parents[2] / "scenes"


def test_vertex_field_script(mi, tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    spec = importlib.util.spec_from_file_location("vertex_field_script", SCRIPTS / "vertex_field.py")
    assert spec is not None and spec.loader is not None
    script = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(script)
    monkeypatch.setattr(script, "ROUND", 96)
    monkeypatch.setattr(script, "ACROSS", 48)
    script.main(str(tmp_path / "ring.png"), spp=1)

    picture = read_image(tmp_path / "ring.png")
    assert picture.shape == (720, 960, 3)
    traced, color, roughness = picture[:360, :480], picture[:360, 480:], picture[360:, :480]
    ring = roughness.max(axis=-1) > 0
    assert 0.3 < ring.mean() < 0.7
    assert not color[~ring].any()  # the floor shows the background
    warm = color[ring][:, 0] > 1.5 * color[ring][:, 2]
    cool = color[ring][:, 2] > 1.5 * color[ring][:, 0]
    assert warm.mean() > 0.2 and cool.mean() > 0.2
    assert 0.2 < traced[~ring].mean() < 0.8  # the lit floor
