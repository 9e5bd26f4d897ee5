"""Films of textures that move."""

import numpy as np
import pytest

from mitex.cli import main
from mitex.errors import ConfigError
from mitex.images import read_image
from mitex.mesh import icosphere
from mitex.methods.nca import NcaTexture
from tests.methods.nca import tiny

OPTIONS = {"seconds": 0.1, "fps": 20, "start": 6, "resolution": 48, "subdivide": 0}


@pytest.fixture(scope="module")
def moving():
    return NcaTexture(tiny.texture(condition=3, shape=None).look, {"name": "flow", "motion": "right"})


def _last(folder):
    return read_image(sorted(folder.glob("*.png"))[-1])


@pytest.mark.parametrize("option", [{"field": "up"}, {"speed": 3.0}])
def test_field_and_speed_count(moving, tmp_path, option):
    sphere = icosphere(4)
    frames = [
        _last(moving.animate(sphere, tmp_path / name, **OPTIONS, **more))
        for name, more in (("a", {}), ("b", option))
    ]
    assert np.abs(frames[0] - frames[1]).max() > 0.02


def test_the_command_line_has_both(moving, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    moving.save("flow.safetensors")
    words = "--seconds 0.1 --fps 20 --start 6 --resolution 48 --quiet"
    for name, more in (("a", ""), ("b", "--field up"), ("c", "--speed 3")):
        assert main(f"animate flow.safetensors --mesh octopus --out {name}/ {words} {more}".split()) == 0
    a, b, c = (_last(tmp_path / name) for name in "abc")
    assert np.abs(a - b).max() > 0.02 and np.abs(a - c).max() > 0.02


def test_a_speed_of_a_texture_that_stands_still(tmp_path):
    with pytest.raises(ConfigError, match="'tiny' stands still"):
        tiny.texture().animate(icosphere(4), tmp_path / "film", **OPTIONS, speed=2.0)
    assert not list(tmp_path.iterdir())
