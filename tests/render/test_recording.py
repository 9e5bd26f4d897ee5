"""Films keep their frames until they are whole: what is resumed is what would have been."""

import os
import signal
from functools import partial

import imageio.v3 as iio
import imageio_ffmpeg
import numpy as np
import pytest
from PIL import Image, ImageSequence

from mitex.errors import ConfigError, OutputError
from mitex.render.recording import Recording

SIDE = 16


def picture(k, period=8):
    """A bright square that goes round."""
    image = np.zeros((SIDE, SIDE, 3), np.float32)
    angle = 2 * np.pi * k / period
    row, column = (8 + 5 * np.array([np.sin(angle), np.cos(angle)])).round().astype(int)
    image[row - 2 : row + 2, column - 2 : column + 2] = 1.0
    return image


def pictures(done, count=100, calls=None, stop=None):
    for k in range(done, count):
        if k == stop:
            os.kill(os.getpid(), signal.SIGINT)
        if calls is not None:
            calls.append(k)
        yield picture(k)


def recording(path, frames=8, settings=None, **options):
    return Recording.of(path, frames, options.pop("fps", 12), SIDE, settings or {"seed": 0}, **options)


def film(path, frames=8, resume=False, stop=None, calls=None, **options):
    planned = recording(path, frames, **options)
    return planned.record(partial(pictures, count=planned.pictures, stop=stop, calls=calls), resume)


def test_frames_size_and_speed_are_read_back(tmp_path):
    path = film(tmp_path / "a.mp4", 10)
    count, seconds = imageio_ffmpeg.count_frames_and_secs(str(path))
    details = next(imageio_ffmpeg.read_frames(str(path)))
    assert count == 10 and seconds == pytest.approx(10 / 12, abs=0.02)
    assert details["size"] == (SIDE, SIDE) and details["fps"] == 12
    assert [p.name for p in tmp_path.iterdir()] == ["a.mp4"]


@pytest.mark.parametrize(("fps", "milliseconds"), [(12, [80, 90, 80]), (25, [40] * 3), (60, [20] * 3)])
def test_gifs_keep_time_in_hundredths(tmp_path, fps, milliseconds):
    with Image.open(film(tmp_path / "a.gif", 8, fps=fps)) as image:
        durations = [frame.info["duration"] for frame in ImageSequence.Iterator(image)]
    assert len(durations) == 8 and durations[:3] == milliseconds


def test_a_folder_of_frames(tmp_path):
    path = film(f"{tmp_path}/new/frames/", 3)
    assert sorted(p.name for p in path.iterdir()) == ["0000.png", "0001.png", "0002.png"]
    assert np.array_equal(iio.imread(path / "0002.png"), (255 * picture(2)).astype(np.uint8))
    assert [p.name for p in path.parent.iterdir()] == ["frames"]


def test_a_loop_has_the_length_of_a_period_and_no_seam(tmp_path):
    path = film(tmp_path / "loop", 12, fade=2)
    frames = np.stack([iio.imread(p) for p in sorted(path.iterdir())])
    assert len(frames) == 8
    assert all(np.array_equal(frame, np.roll(frames, -1, 0)[k - 1]) for k, frame in enumerate(frames))


@pytest.mark.parametrize("name", ["a.mp4", "frames"])
def test_an_interrupted_film_is_resumed_byte_for_byte(tmp_path, name):
    whole, calls = film(tmp_path / "whole" / name), []
    with pytest.raises(
        KeyboardInterrupt, match="after 4 of 8 frames, which are kept; go on with `resume=True`"
    ):
        film(tmp_path / name, stop=3)
    assert {p.name for p in tmp_path.iterdir()} == {"whole", f".{name}.frames"}
    film(tmp_path / name, resume=True, calls=calls)
    assert calls == [4, 5, 6, 7] and {p.name for p in tmp_path.iterdir()} == {"whole", name}
    for one, other in zip(files(whole), files(tmp_path / name), strict=True):
        assert one.read_bytes() == other.read_bytes()


def files(path):
    return sorted(path.iterdir()) if path.is_dir() else [path]


def test_a_film_of_other_settings_is_not_resumed(tmp_path):
    with pytest.raises(KeyboardInterrupt):
        film(tmp_path / "a.gif", stop=3)
    with pytest.raises(ConfigError, match="had another seed; resume with the same"):
        film(tmp_path / "a.gif", settings={"seed": 1}, resume=True)
    calls = []
    film(tmp_path / "a.gif", settings={"seed": 1}, calls=calls)
    assert calls == list(range(8)) and [p.name for p in tmp_path.iterdir()] == ["a.gif"]


def test_there_is_nothing_to_resume(tmp_path):
    with pytest.raises(OutputError, match=r"no interrupted film 'a.gif' to resume; start without"):
        film(tmp_path / "a.gif", resume=True)


def test_an_error_leaves_the_frames(tmp_path):
    def broken(done):
        yield from pictures(done, 2)
        raise ConfigError("no more", "stop")

    with pytest.raises(ConfigError, match="no more"):
        recording(tmp_path / "a.gif").record(broken)
    assert [p.name for p in tmp_path.iterdir()] == [".a.gif.frames"]


BAD = {
    "no frames": ({"frames": 0}, "a.mp4", "a video of 0 frames"),
    "no speed": ({"fps": 0}, "a.mp4", "at 0 per second"),
    "a long fade": ({"fade": 5}, "a.mp4", "a cross-fade of 5 frames"),
    "another format": ({}, "a.avi", "use one of .mp4, .gif"),
    "a model": ({}, "a.glb", "looks to choose from, not a sequence in time"),
    "a full folder": ({}, "full", "is not empty"),
    "a file": ({}, "full/file/frames", "is a file"),
}


@pytest.mark.parametrize("name", BAD)
def test_what_cannot_be_filmed_is_refused(tmp_path, name):
    options, path, message = BAD[name]
    (tmp_path / "full").mkdir()
    (tmp_path / "full" / "file").touch()
    with pytest.raises((ConfigError, OutputError), match=message):
        recording(tmp_path / path, **options)
    assert {p.name for p in tmp_path.rglob("*")} == {"full", "file"}


def test_a_folder_of_others_is_left_alone(tmp_path):
    notes = tmp_path / ".a.gif.frames" / "notes.txt"
    notes.parent.mkdir()
    notes.write_text("mine")
    with pytest.raises(OutputError, match="is in the way, and not of an interrupted film; move it"):
        film(tmp_path / "a.gif", 3)
    assert notes.read_text() == "mine"
