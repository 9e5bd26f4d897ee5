"""Films of textures that move."""

import signal

import numpy as np
import pytest

from mitex.cli import main
from mitex.errors import ConfigError
from mitex.images import read_image
from mitex.mesh import icosphere
from mitex.methods.nca import Graft, NcaTexture, film
from tests.methods.nca import tiny

OPTIONS = {"seconds": 0.1, "fps": 20, "start": 6, "resolution": 48, "subdivide": 0}


@pytest.fixture(scope="module")
def moving():
    return NcaTexture(tiny.texture(condition=3, shape=None).look, {"name": "flow", "motion": "right"})


def _last(folder):
    return read_image(sorted(folder.glob("*.png"))[-1])


ABOUT = {"name": "flow", "family": "one", "motion": "right", "motion_advection": True, "relief": 2.5}
COLOURS = [[0.2, 0.5, 0.5], [0.8, 0.5, 0.5]]
PALETTES = [{"colours": COLOURS, "radius": 0.2}, {"colours": COLOURS, "radius": 0.3}]
PALETTES += [{"colours": [[0.2, 0.5, 0.5], [0.9, 0.5, 0.5]], "radius": 0.2}]


def words(seed=0, condition=0, **about):
    texture = tiny.texture(("albedo", "height"), seed=seed, shape=None, condition=condition)
    return NcaTexture(texture.look, ABOUT | {"palette": PALETTES[0]} | about)


def grafted(weights=0.5, **about):
    return Graft(words(), words(1, **about), lambda points: np.full(len(points), weights, np.float32))


FILMS = {
    "a texture": (
        words,
        [{"field": "up"}, {"speed": 2.0}, {"orientation": 90.0}],
        [{"relief": 2.0}, {"palette": PALETTES[1]}, {"palette": PALETTES[2]}, {"motion_period": 9.0}],
    ),
    "one that knows the field": (
        lambda **about: words(condition=3, **{"motion_advection": False} | about),
        [{"field": "up"}, {"speed": 2.0}],
        [],
    ),
    "a graft": (
        grafted,
        [{"field": "up"}, {"orientation": 90.0}],
        [{"weights": 0.25}, {"relief": 2.0}, {"palette": PALETTES[1]}, {"motion_period": 9.0}],
    ),
}


@pytest.mark.parametrize("name", FILMS)
def test_films_are_resumed_with_the_same_texture_alone(tmp_path, monkeypatch, name):
    """Another motion, orientation, mixture, relief or palette would show in the rest of the frames."""
    made, options, abouts = FILMS[name]
    settings = OPTIONS | {"seconds": 0.2, "start": 0, "resolution": 16}
    sphere, picture = icosphere(3), film.PreviewCamera.picture
    with monkeypatch.context() as patch:

        def stopped(camera, grown):
            signal.raise_signal(signal.SIGINT)
            return picture(camera, grown)

        patch.setattr(film.PreviewCamera, "picture", stopped)
        with pytest.raises(KeyboardInterrupt):
            made().animate(sphere, tmp_path / "film", **settings)
    others = [(made(), option) for option in options] + [(made(**about), {}) for about in abouts]
    for texture, option in others:
        with pytest.raises(ConfigError, match="had another texture"):
            texture.animate(sphere, tmp_path / "film", **settings, **option, resume=True)
    made().animate(sphere, tmp_path / "film", **settings, resume=True)


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
