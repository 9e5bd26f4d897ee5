"""Files of stills and turntables."""

import math
import sys
from typing import Any

import imageio.v3 as iio
import numpy as np
import pytest
from PIL import Image

from mitex.asset import Asset
from mitex.colour import linear_to_srgb
from mitex.errors import ConfigError, OutputError
from mitex.mesh import icosphere
from mitex.progress import listening
from mitex.render import film, render_still, tone, turntable
from tests.export.common import read_exr

ASSET = Asset(icosphere(3), {"albedo": np.full((92, 3), 0.6), "height": np.zeros((92, 1))})
SMALL: dict[str, Any] = {"resolution": 16, "spp": 1}


def test_tone_is_srgb_with_stops():
    linear = np.array([0.0, 0.2, 0.5, 3.0])
    np.testing.assert_allclose(tone(linear), linear_to_srgb(np.minimum(linear, 1)), atol=1e-6)
    np.testing.assert_allclose(tone(linear, 1.0), tone(2 * linear), atol=1e-6)
    for exposure in (11, math.nan):
        with pytest.raises(ConfigError, match="exposure"):
            tone(linear, exposure)


def test_stills_of_all_formats_agree(tmp_path):
    exr = read_exr(ASSET.render(tmp_path / "a.exr", **SMALL))
    png = np.asarray(Image.open(ASSET.render(tmp_path / "a.png", **SMALL)), np.float32) / 255
    Image.open(ASSET.render(tmp_path / "a.jpg", **SMALL)).verify()
    linear = np.stack([exr[k] for k in "RGB"], axis=2).astype(np.float32)
    np.testing.assert_allclose(tone(linear), png, atol=0.01)


@pytest.mark.parametrize("name", ["a.mp4", "a.gif"])
def test_turntables_have_all_frames_and_turn(name, tmp_path):
    albedo = np.where(ASSET.mesh.vertices[:, :1] > 0, [[0.9, 0.1, 0.1]], [[0.1, 0.1, 0.9]])
    asset, calls = Asset(ASSET.mesh, {"albedo": albedo}), []
    with listening(lambda *call: calls.append(call)):
        path = turntable(asset, tmp_path / name, frames=4, fps=10, resolution=32, spp=4)
    frames = iio.imread(path)
    assert frames.shape == (4, 32, 32, 3)
    assert calls[-5:] == [("rendering frames", k, 4) for k in range(5)]
    red = frames[:, 12:20, 12:20].mean(axis=(1, 2))
    assert red[1, 0] > 2 * red[1, 2] and red[3, 2] > 2 * red[3, 0]  # from +x, then from -x
    assert [p.name for p in tmp_path.iterdir()] == [name]


def test_films_show_assets_in_turn_without_moving_the_camera(tmp_path):
    """A ball, and one half as large: its silhouette has a quarter of the pixels."""
    ball = ASSET.mesh
    small = ball.with_vertices(0.5 * ball.vertices)
    dark = {"albedo": np.zeros((92, 3))}
    assets = [Asset(mesh, dark) for mesh in (ball, small, ball)]
    path = film(assets, tmp_path / "a.gif", frames=3, like=ball, resolution=64, spp=4)
    areas = (iio.imread(path).mean(axis=3) < 60).sum(axis=(1, 2))
    assert areas[0] == areas[2] > 800
    assert areas[1] / areas[0] == pytest.approx(0.25, abs=0.05)


def test_gifs_loop_forever(tmp_path):
    image = Image.open(turntable(ASSET, tmp_path / "a.gif", frames=2, fps=10, **SMALL))
    assert image.info["loop"] == 0 and image.info["duration"] == 100


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"frames": 1}, "a video of 1 frames"),
        ({"fps": 0}, "at 0 per second"),
        ({"resolution": 33}, "even size"),
        ({"exposure": 99.0}, "exposure"),
        ({"elevation": -0.5}, "elevation"),
    ],
)
def test_wrong_options_leave_nothing(options, message, tmp_path):
    with pytest.raises(ConfigError, match=message):
        turntable(ASSET, tmp_path / "a.mp4", **options)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize("write", [render_still, turntable])
def test_unwritable_places_are_told_before_rendering(write, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "mitsuba", None)
    (tmp_path / "file").write_text("")
    for name in ("a.bmp", "a", "file/a.png", "file/a.mp4"):
        with pytest.raises(OutputError):
            write(ASSET, tmp_path / name)


def test_a_failing_encoder_leaves_nothing(tmp_path, monkeypatch):
    import imageio_ffmpeg

    monkeypatch.setattr(imageio_ffmpeg, "get_ffmpeg_exe", lambda: "/bin/false")
    monkeypatch.setattr("imageio_ffmpeg._io.get_ffmpeg_exe", lambda: "/bin/false")
    with pytest.raises(OutputError):
        turntable(ASSET, tmp_path / "a.mp4", frames=3, **SMALL)
    assert list(tmp_path.iterdir()) == []
