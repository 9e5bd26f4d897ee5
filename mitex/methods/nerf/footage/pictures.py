"""Reading what was filmed: a video by ffmpeg, or a folder of photos, as upright pictures one by one."""

from __future__ import annotations

import re
import subprocess
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from pathlib import Path
from tempfile import TemporaryFile
from typing import IO

import numpy as np
from PIL import Image

from mitex.errors import CaptureError, ImageError
from mitex.images import SUFFIXES, read_bytes
from mitex.paths import expanded

PHONE_SUFFIXES = (".heic", ".heif", ".hif")
HDR_TRANSFERS = (b"arib-std-b67", b"smpte2084")
# White is where ITU-R BT.2408 puts that of a lit page, 203 cd/m^2; what is brighter is compressed.
TO_SRGB = (
    "zscale=t=linear:npl=203,format=gbrpf32le,zscale=p=bt709,tonemap=mobius:desat=0,"
    "zscale=t=iec61966-2-1:m=gbr,format=gbrp"
)
SMALLEST = 16  # side of a picture [pixels]
VIDEO = "give an MP4 or MOV video, or a folder of PNG or JPEG photos"


@dataclass(frozen=True, eq=False)
class Picture:
    """A frame or a photo.

    Attributes:
        name: of the file that it becomes, without suffix: the frame's number, or the photo's name.
        pixels: (H, W, 3) uint8 sRGB, upright.
    """

    name: str
    pixels: np.ndarray


@dataclass(frozen=True)
class Footage:
    """Pictures in the order in which they were taken.

    Attributes:
        source: the video, or the folder.
        count: of the pictures.
        video: whether they are frames of a video, of which there are more than are needed.
        read: gives them, each time from the start.
    """

    source: Path
    count: int
    video: bool
    read: Callable[[], Iterator[Picture]]


def footage(source: str | Path, size: int) -> Footage:
    """A video, or a folder of photos in the order of their names, scaled down to `size` [pixels].

    The orientation that a phone notes in the file is obeyed.

    Args:
        source: the file or folder.
        size: longer side of the pictures, at most.

    Raises:
        CaptureError: there is none, it cannot be read, it is no video, or the folder holds no photos.
        ImageError: while they are read, one that is damaged, or scaled down has a side below 16 pixels.
    """
    path = expanded(source)
    try:
        if path.is_dir():
            return _photos(path, size)
        if not path.is_file():
            raise CaptureError(f"{source} does not exist", VIDEO)
    except OSError as error:
        raise CaptureError(
            f"{str(source)[:80]} cannot be read ({error.strerror})", "check its name and its permissions"
        ) from error
    count, is_hdr = _stream(path)
    return Footage(path, count, True, lambda: _frames(path, size, is_hdr))


def _photos(folder: Path, size: int) -> Footage:
    inner = folder / "images" if (folder / "images").is_dir() else folder
    if heic := sorted(path for path in inner.iterdir() if path.suffix.lower() in PHONE_SUFFIXES):
        raise CaptureError(f"{heic[0]} is a HEIC photo, which Mitex cannot read", "export photos as JPEG")
    paths = sorted(path for path in inner.iterdir() if path.suffix.lower() in SUFFIXES and path.is_file())
    if not paths:
        raise CaptureError(f"{folder} holds no photos", VIDEO)
    twice = {path.stem for path in paths if sum(path.stem == other.stem for other in paths) > 1}
    if twice:
        raise CaptureError(f"{folder} has two photos named {min(twice)}", "rename one of them")

    def read() -> Iterator[Picture]:
        for path in paths:
            image = Image.fromarray(np.ascontiguousarray(read_bytes(path)[..., :3]))
            image.thumbnail((size, size), Image.Resampling.LANCZOS)
            yield Picture(path.stem, _large_enough(np.asarray(image), path))

    return Footage(folder, len(paths), False, read)


def _large_enough(pixels: np.ndarray, path: Path) -> np.ndarray:
    height, width = pixels.shape[:2]
    if min(height, width) < SMALLEST:
        raise ImageError(f"{path} gives pictures of {width} x {height} pixels", "leave out what is so narrow")
    return pixels


def _stream(path: Path) -> tuple[int, bool]:
    """How many frames a video has, without decoding them, and whether they are HDR (HLG or PQ)."""
    done = subprocess.run(
        [*_ffmpeg(path), "-c", "copy", "-f", "null", "-"], stdin=subprocess.DEVNULL, capture_output=True
    )
    counts = re.findall(rb"frame=\s*(\d+)", done.stderr)
    if done.returncode or not counts:
        raise CaptureError(f"{path} is not a video that ffmpeg can read", VIDEO)
    return int(counts[-1]), any(name in done.stderr for name in HDR_TRANSFERS)


def _frames(path: Path, size: int, is_hdr: bool) -> Iterator[Picture]:
    """Decoded frames; ffmpeg turns them upright, and HDR to sRGB."""
    scale = f"scale='min({size},iw)':'min({size},ih)':force_original_aspect_ratio=decrease:flags=area"
    pipe = [
        "-fps_mode",
        "passthrough",
        "-vf",
        f"{scale},{TO_SRGB}" if is_hdr else scale,
        "-pix_fmt",
        "rgb24",
        "-c:v",
        "ppm",
        "-f",
        "image2pipe",
        "-",
    ]
    # What ffmpeg says goes to a file: a pipe that nobody reads would fill up.
    with (
        TemporaryFile() as log,
        subprocess.Popen(
            [*_ffmpeg(path), *pipe], stdin=subprocess.DEVNULL, stdout=subprocess.PIPE, stderr=log
        ) as decoder,
    ):
        assert decoder.stdout is not None
        try:
            for number, pixels in enumerate(_portable_pixmaps(decoder.stdout)):
                yield Picture(f"{number:05}", _large_enough(pixels, path))
        finally:
            decoder.kill()


def _portable_pixmaps(stream: IO[bytes]) -> Iterator[np.ndarray]:
    """Pictures (H, W, 3) uint8 of a stream of PPM files, up to the last whole one."""
    while stream.readline() == b"P6\n":
        width, height = map(int, stream.readline().split())
        stream.readline()  # the largest value
        data = stream.read(width * height * 3)
        if len(data) < width * height * 3:
            return
        yield np.frombuffer(data, np.uint8).reshape(height, width, 3)


def _ffmpeg(path: Path) -> list[str]:
    """ffmpeg with a file as its input: no network, and its name is no address."""
    from imageio_ffmpeg import get_ffmpeg_exe

    return [
        get_ffmpeg_exe(),
        "-hide_banner",
        "-protocol_whitelist",
        "file",
        "-i",
        f"file:{path}",
        "-map",
        "0:v:0",
    ]
