"""Pictures in a row as a video file."""

from __future__ import annotations

import errno
import os
from collections.abc import Iterable, Iterator, Sequence
from contextlib import suppress
from pathlib import Path
from subprocess import DEVNULL, PIPE, Popen
from tempfile import TemporaryFile

import numpy as np
from PIL import Image

from mitex.errors import ConfigError, OutputError
from mitex.images import to_bytes
from mitex.paths import atomic_write, prepare_output
from mitex.progress import counted
from mitex.ranges import FRAME_RATES, FRAMES
from mitex.suffixes import VIDEOS as VIDEO_SUFFIXES

QUALITY = 15  # of H.264: the constant rate factor, of which lower ones look better


def check_video(path: str | os.PathLike[str], frames: int, fps: int, resolution: int) -> Path:
    """The place of a video to be written: `frames` (2 to 3600) at `fps` (1 to 60) a second.

    Raises:
        OutputError: unknown suffix, or unwritable place.
        ConfigError: a number out of range, or an odd side [px] for .mp4.
    """
    target = prepare_output(path, VIDEO_SUFFIXES)
    (fewest, most), (slowest, fastest) = FRAMES, FRAME_RATES
    if not fewest <= frames <= most or not slowest <= fps <= fastest:
        raise ConfigError(
            f"a video of {frames} frames at {fps} per second is not possible",
            f"use {fewest} to {most} at {slowest} to {fastest}",
        )
    if target.suffix.lower() == ".mp4" and resolution % 2:
        raise ConfigError(f"MP4 needs an even size, not {resolution}", f"use {resolution + 1}")
    return target


def write_video(
    target: Path,
    pictures: Iterable[np.ndarray],
    frames: int,
    fps: int,
    side: int,
    work: str = "rendering frames",
) -> Path:
    """Writes `frames` pictures (side, side, 3), sRGB in [0, 1], as .mp4 (H.264) or .gif, by the suffix.

    Pictures are drawn from the iterable as they are written, so that a film need not fit into memory as .mp4.
    How many are written is announced as `work` (`mitex.progress`).

    Raises:
        ConfigError: there are fewer or more pictures than `frames`; nothing is left then.
        OutputError: the encoder failed, or the place is not writable; nothing is left then.
    """

    def bytes_of() -> Iterator[np.ndarray]:
        done = 0
        for done, picture in enumerate(counted(work, pictures, frames), 1):
            if done > frames:
                raise ConfigError(f"more pictures than the {frames} frames of a video", "raise frames")
            yield to_bytes(picture)
        if done < frames:
            raise ConfigError(f"{done} pictures for a video of {frames} frames", "give one for each frame")

    with atomic_write(target) as temporary:
        (_write_gif if target.suffix.lower() == ".gif" else _write_mp4)(temporary, bytes_of(), fps, side)
    return target


def _write_mp4(path: Path, pictures: Iterator[np.ndarray], fps: int, side: int) -> None:
    from imageio_ffmpeg import get_ffmpeg_exe

    raw = f"-f rawvideo -pix_fmt rgb24 -s {side}x{side} -r {fps} -i -"
    mp4 = f"-an -vcodec libx264 -pix_fmt yuv420p -crf {QUALITY} -movflags +faststart"
    command = [get_ffmpeg_exe(), "-y", "-loglevel", "error", *raw.split(), *mp4.split(), str(path)]
    # What ffmpeg says goes to a file: a pipe that nobody reads would fill up.
    with TemporaryFile() as log, Popen(command, stdin=PIPE, stdout=DEVNULL, stderr=log) as encoder:
        assert encoder.stdin is not None
        try:
            with suppress(BrokenPipeError):  # it has ended by itself, and its exit status tells
                for picture in pictures:
                    encoder.stdin.write(np.ascontiguousarray(picture).data)
                encoder.stdin.close()
            failed = encoder.wait() != 0
        except BaseException:
            encoder.kill()
            raise
        log.seek(0)
        words = log.read().decode("utf-8", "replace").split()
    if os.strerror(errno.ENOSPC) in " ".join(words):
        raise OSError(errno.ENOSPC, "ffmpeg")
    if failed:
        reason = " ".join(words)[-200:] or "it did not say why"
        raise OutputError(f"ffmpeg wrote no video ({reason})", "check the free space and `mitex doctor`")


def _write_gif(path: Path, pictures: Iterator[np.ndarray], fps: int, side: int) -> None:
    images = [Image.fromarray(p) for p in pictures]
    # One palette for all frames, or colours would flicker.
    palette = _strip(images[:: max(1, len(images) // 8)]).quantize(256, Image.Quantize.MEDIANCUT)
    indexed = [i.quantize(palette=palette, dither=Image.Dither.FLOYDSTEINBERG) for i in images]
    durations = gif_durations(len(indexed), fps)
    indexed[0].save(path, "GIF", save_all=True, append_images=indexed[1:], duration=durations, loop=0)


def gif_durations(frames: int, fps: int) -> list[int]:
    """How long each frame of a GIF stands [ms]: hundredths of a second, which add up to `frames` / `fps`, but
    at least two, as viewers slow down anything faster.
    """
    ends = np.round(np.arange(frames + 1) * (100.0 / fps)).astype(int)
    return [10 * max(2, int(duration)) for duration in np.diff(ends)]


def _strip(images: Sequence[Image.Image]) -> Image.Image:
    """Images of one size side by side."""
    strip = Image.new("RGB", (images[0].width * len(images), images[0].height))
    for k, image in enumerate(images):
        strip.paste(image, (k * image.width, 0))
    return strip
