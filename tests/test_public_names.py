"""The few lines that README promises, for textures of whichever method."""

import pytest

import mitex
from mitex.images import read_image
from mitex.mesh import icosphere


@pytest.mark.parametrize("name", ["pebbles", "spikes"])
def test_a_texture_is_loaded_applied_exported_and_rendered(name, tmp_path):
    applied = mitex.load(name).apply(icosphere(8), seed=0)
    assert applied.export(tmp_path / "ball.glb").is_file()
    applied.render(tmp_path / "ball.png", resolution=32, spp=1)
    assert read_image(tmp_path / "ball.png").shape == (32, 32, 3)
    assert all(values.dtype == "float32" for values in applied.maps.values())
