"""Pictures in a row as a video file."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
from PIL import Image

from mitex.errors import ConfigError, OutputError
from mitex.paths import atomic_write, prepare_output
from mitex.progress import counted

VIDEO_SUFFIXES = (".mp4", ".gif")


def check_video(path: str | os.PathLike[str], frames: int, fps: int, resolution: int) -> Path:
    """The place of a video to be written: `frames` (2 to 3600) at `fps` (1 to 60) a second.

    Raises:
        OutputError: unknown suffix, or unwritable place.
        ConfigError: a number out of range, or an odd side [px] for .mp4.
    """
    target = prepare_output(path, VIDEO_SUFFIXES)
    if not 2 <= frames <= 3600 or not 1 <= fps <= 60:
        raise ConfigError(
            f"a video of {frames} frames at {fps} per second is not possible", "use 2 to 3600 at 1 to 60"
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
            yield np.round(picture * 255.0).astype(np.uint8)
        if done < frames:
            raise ConfigError(f"{done} pictures for a video of {frames} frames", "give one for each frame")

    with atomic_write(target) as temporary:
        (_write_gif if target.suffix.lower() == ".gif" else _write_mp4)(temporary, bytes_of(), fps, side)
    return target


def _write_mp4(path: Path, pictures: Iterator[np.ndarray], fps: int, side: int) -> None:
    import imageio_ffmpeg

    encoder = imageio_ffmpeg.write_frames(
        str(path),
        (side, side),
        fps=fps,
        codec="libx264",
        quality=7,
        macro_block_size=2,
        output_params=["-movflags", "+faststart"],
        ffmpeg_log_level="error",
    )
    encoder.send(None)
    try:
        for picture in pictures:
            encoder.send(np.ascontiguousarray(picture))
    finally:
        encoder.close()
    if not path.is_file() or path.stat().st_size == 0:
        raise OutputError("ffmpeg wrote no video", "check the free space and `mitex doctor`")


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
