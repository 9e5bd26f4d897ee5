"""Films show the automaton's states in turn; every option changes what they show."""

import math
import signal

import imageio.v3 as iio
import numpy as np
import pytest
import torch

from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate
from mitex.geometry.vectors import unit
from mitex.mesh import icosphere
from mitex.methods.nca import Graft, NcaTexture, film
from mitex.methods.nca.cells import Cells
from mitex.methods.nca.growth import grown_state
from mitex.methods.nca.weights import graft_weights
from mitex.render.preview import PreviewRenderer
from tests.methods.nca import tiny

SPHERE, MAPS = icosphere(6), ("albedo", "ambient_occlusion", "normal")
SHORT = {"seconds": 1.0, "fps": 4, "resolution": 24, "subdivide": 0, "steps_per_frame": 3}


@pytest.fixture(scope="module")
def texture():
    return tiny.texture(MAPS, shape=None)


def frames(folder):
    return np.stack([iio.imread(path) for path in sorted(folder.iterdir())]).astype(int)


def shoot(texture, folder, **options):
    return frames(texture.animate(SPHERE, folder, **{**SHORT, **options}))


@pytest.fixture(scope="module")
def plain(texture, tmp_path_factory):
    return shoot(texture, tmp_path_factory.mktemp("films") / "plain")


def test_frames_are_states_some_steps_apart(texture, plain, tmp_path):
    """What a film from a later start shows at first is what the other one shows then."""
    assert plain.shape == (4, 24, 24, 3) and np.ptp(plain[3]) > 30
    assert all(np.abs(a - b).max() > 3 for a, b in zip(plain, plain[1:], strict=False))
    assert np.array_equal(shoot(texture, tmp_path / "later", start=6, seconds=0.5), plain[2:])
    assert np.array_equal(shoot(texture, tmp_path / "slow", steps_per_frame=6, seconds=0.5), plain[::2])


@pytest.mark.parametrize(
    "options",
    [
        *({"seed": 1}, {"orientation": 90.0}, {"azimuth": 120.0}, {"elevation": 70.0}, {"subdivide": 1}),
        {"damage": "0,0,1,0.9", "start": 0},
    ],
    ids=str,
)
def test_no_option_is_ignored(texture, plain, tmp_path, options):
    assert np.abs(shoot(texture, tmp_path / "other", **options) - plain).max() > 3


def test_the_scale_is_not_ignored(texture, plain, tmp_path):
    pytest.importorskip("pymeshlab")
    assert np.abs(shoot(texture, tmp_path / "other", scale=0.8) - plain).max() > 3


@pytest.mark.parametrize("fps", [4, 10])
def test_frames_last_as_long_as_asked_for(texture, tmp_path, fps):
    path = texture.animate(SPHERE, tmp_path / "a.gif", **{**SHORT, "fps": fps, "resolution": 16})
    assert iio.immeta(path)["duration"] == 1000 / fps and len(iio.imread(path)) == fps


def test_the_path_tracer_takes_as_many_samples_as_asked_for(texture, tmp_path, monkeypatch):
    samples = []

    def render(renderer, azimuth, view, spp):
        samples.append(spp)
        return np.zeros((24, 24, 3), np.float32)

    monkeypatch.setattr(film.OrbitRenderer, "render", render)
    shoot(texture, tmp_path / "film", seconds=0.5, renderer="path", spp=7)
    assert samples == [7, 7]


def test_the_preview_shows_normals_and_ambient_occlusion(texture):
    settings, growth = film.FilmSettings(resolution=24), texture.growth(Cells(SPHERE, 0, SPHERE))
    shown = growth.texture(grown_state(growth, 0, 12))
    view = {"resolution": 24, "azimuth": settings.azimuth, "elevation": settings.elevation}
    renderer = PreviewRenderer(SPHERE, **view)
    points = renderer.face, renderer.barycentric
    maps = shown.maps(shown.values(*points))
    normals, occlusion = unit(shown.object_normals(maps["normal"], *points)), maps["ambient_occlusion"]
    own = unit(interpolate(renderer.barycentric, SPHERE.shading_normals[renderer.face]))
    picture = film.PreviewCamera(SPHERE, settings).picture(shown)
    assert np.allclose(picture, renderer.render(maps["albedo"], normals, occlusion), atol=1e-5)
    for others in ((own, occlusion), (normals, 1.0)):
        assert np.abs(picture - renderer.render(maps["albedo"], *others)).max() > 0.02


def test_a_damaged_region_is_set_back_at_its_time_and_grows_again(texture):
    states, cells = {}, Cells(SPHERE, 0, SPHERE)
    inside = torch.from_numpy(SPHERE.vertices[:, 1] > 0)
    for damage in (None, inside):
        settings = film.FilmSettings(seconds=1, fps=4, steps_per_frame=3, start=6, damage_at=0.5)
        shot = film.States(texture.growth(cells), settings, 0, damage)
        states[damage is not None] = list(shot.frames(0, 4))
    whole, damaged = states[False], states[True]
    assert all(torch.equal(a, b) for a, b in zip(whole[:2], damaged[:2], strict=True))
    assert not damaged[2][inside].any() and torch.equal(damaged[2][~inside], whole[2][~inside])
    assert damaged[3][inside].any()


def test_films_of_damage_start_when_the_pattern_is_in_order(texture, tmp_path):
    slow = type(texture)(texture.look, {"name": "slow", "growth_steps": 9})
    first = shoot(slow, tmp_path / "a", damage="y:0:", seconds=0.5, damage_at=0.3)[0]
    assert np.array_equal(first, shoot(slow, tmp_path / "b", start=9, seconds=0.5)[0])


def test_it_is_resumed_with_the_same_frames(texture, plain, tmp_path, monkeypatch):
    picture, count = film.PreviewCamera.picture, 0

    def stopped(camera, grown):
        nonlocal count
        count += 1
        if count == 2:
            signal.raise_signal(signal.SIGINT)
        return picture(camera, grown)

    monkeypatch.setattr(film.PreviewCamera, "picture", stopped)
    with pytest.raises(KeyboardInterrupt, match="after 2 of 4 frames"):
        shoot(texture, tmp_path / "film")
    with pytest.raises(ConfigError, match="had another texture and seed"):
        shoot(tiny.texture(MAPS, seed=1), tmp_path / "film", seed=1, resume=True)
    assert np.array_equal(shoot(texture, tmp_path / "film", resume=True), plain) and count == 4


def test_path_traced_frames_show_the_same_states(texture, plain, tmp_path):
    """Those of one renderer that changes its look are those of renderers of their own."""
    options = {"renderer": "path", "spp": 4, "resolution": 32}
    both = shoot(texture, tmp_path / "both", seconds=0.5, **options)
    second = shoot(texture, tmp_path / "second", seconds=0.5, start=3, **options)
    assert np.abs(both[1] - second[0]).mean() < 0.5 < np.abs(both[0] - both[1]).mean()


def test_a_graft_is_filmed_too(texture, plain, tmp_path):
    other = tiny.texture(MAPS, seed=1, shape=None)
    pair = (NcaTexture(one.look, {"name": "a relative", "family": "one"}) for one in (texture, other))
    first, second = pair
    grafted = Graft(first, second, graft_weights(SPHERE, 0))
    assert np.array_equal(shoot(grafted, tmp_path / "film"), plain)


BAD = {
    "another renderer": ({"renderer": "raster"}, "no renderer 'raster'"),
    "a length that is no number": ({"seconds": math.nan}, "seconds is nan"),
    "no end": ({"seconds": math.inf}, "seconds is inf"),
    "a time that is no number": ({"damage": "y:0:", "damage_at": math.nan}, "damage_at is nan"),
    "no way to look": ({"azimuth": math.nan}, "azimuth is nan"),
    "no samples": ({"renderer": "path", "spp": 0}, "0 samples per pixel"),
    "a steep view": ({"renderer": "path", "elevation": 999.0}, "elevation 999 degrees is out of range"),
    "a view from below the floor": ({"renderer": "path", "elevation": -5.0}, "elevation -5 degrees"),
    "pixels": ({"renderer": "path", "resolution": 8}, "a picture of 8 pixels"),
    "no steps": ({"steps_per_frame": 0}, "0 steps a frame"),
    "a negative start": ({"start": -1}, "a start after -1 steps"),
    "damage after the end": ({"damage": "y:0:", "damage_at": 2.0}, "choose a time within it"),
    "damage of nothing": ({"damage": "9,9,9,1"}, "nothing of 'icosphere6' is in '9,9,9,1'"),
    "damage in other words": ({"damage": "all"}, "'all' is no region"),
}


@pytest.mark.parametrize("name", BAD)
def test_bad_films_are_refused(texture, tmp_path, name):
    options, message = BAD[name]
    with pytest.raises(ConfigError, match=message):
        shoot(texture, tmp_path / "film", **options)
    assert not list(tmp_path.iterdir())
