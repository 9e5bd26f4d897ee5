"""Pictures become a video, or nothing at all."""

import imageio.v3 as iio
import numpy as np
import pytest

from mitex.errors import ConfigError, OutputError
from mitex.progress import listening
from mitex.render.video import write_video


def pictures(count):
    return (np.full((16, 16, 3), k / max(count, 1), np.float32) for k in range(count))


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
def test_a_picture_for_each_frame(tmp_path, suffix):
    calls = []
    with listening(lambda *call: calls.append(call)):
        path = write_video(tmp_path / f"a{suffix}", pictures(3), 3, 24, 16)
    assert len(iio.imread(path)) == 3 and calls == [("rendering frames", k, 3) for k in range(4)]


@pytest.mark.parametrize("suffix", [".gif", ".mp4"])
@pytest.mark.parametrize("count", [0, 1, 4])
def test_another_number_of_pictures_leaves_nothing(tmp_path, suffix, count):
    with pytest.raises(ConfigError, match="pictures"):
        write_video(tmp_path / f"a{suffix}", pictures(count), 3, 24, 16)
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("words", "message"), [("conversion failed", "wrote no video"), ("No space left on device", "no space")]
)
def test_an_encoder_that_fails_leaves_nothing(tmp_path, monkeypatch, words, message):
    """As on a full disk: it has written something, and its exit status alone tells."""
    encoder = tmp_path / "ffmpeg"
    encoder.write_text(f'#!/bin/sh\nfor last; do :; done\ncat > "$last"\necho "{words}" >&2\nexit 1\n')
    encoder.chmod(0o755)
    monkeypatch.setenv("IMAGEIO_FFMPEG_EXE", str(encoder))
    with pytest.raises(OutputError, match=message):
        write_video(tmp_path / "out" / "a.mp4", pictures(3), 3, 24, 16)
    assert not (tmp_path / "out").exists()
