"""Small videos and photos for tests."""

from __future__ import annotations

import subprocess
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from imageio_ffmpeg import get_ffmpeg_exe
from PIL import Image


def write_film(path: Path, pictures: Sequence[np.ndarray], rotation: int = 0) -> Path:
    """A video (H.264) of pictures (H, W, 3) uint8; players turn it by `rotation` degrees counterclockwise."""
    height, width = pictures[0].shape[:2]
    raw = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r 10 -i -".split()
    made = path.with_stem(f"{path.stem}-level") if rotation else path
    mp4 = ["-c:v", "libx264", "-crf", "12", "-pix_fmt", "yuv420p", "-threads", "1"]
    _run([*raw, *mp4, str(made)], b"".join(picture.tobytes() for picture in pictures))
    if rotation:
        _run(["-display_rotation", str(rotation), "-i", str(made), "-c", "copy", str(path)])
        made.unlink()
    return path


def write_hdr_film(path: Path, pictures: Sequence[np.ndarray], transfer: str) -> Path:
    """A video as phones take it, of 10 bits, whose white is 203 cd/m^2; ffmpeg's name of the transfer."""
    height, width = pictures[0].shape[:2]
    raw = f"-f rawvideo -pix_fmt rgb24 -s {width}x{height} -r 10 -i -".split()
    srgb = "setparams=color_trc=iec61966-2-1:color_primaries=bt709:colorspace=gbr:range=pc,format=gbrp"
    hdr = f"zscale=t={transfer}:p=bt2020:m=bt2020nc:r=tv:npl=203,format=yuv420p10le"
    tags = f"setparams=color_trc={transfer}:color_primaries=bt2020:colorspace=bt2020nc:range=tv"
    mp4 = ["-c:v", "libx265", "-x265-params", "log-level=none", "-crf", "8", "-threads", "1"]
    _run([*raw, "-vf", f"{srgb},{hdr},{tags}", *mp4, str(path)], b"".join(p.tobytes() for p in pictures))
    return path


def write_sound(path: Path) -> Path:
    """A file of sound alone."""
    _run(["-f", "lavfi", "-i", "sine=duration=1", str(path)])
    return path


def write_photos(folder: Path, pictures: Sequence[np.ndarray]) -> Path:
    """A folder of JPEG photos."""
    folder.mkdir(parents=True)
    for k, picture in enumerate(pictures):
        Image.fromarray(picture).save(folder / f"p{k:02}.jpg", quality=95)
    return folder


def _run(words: Sequence[str], data: bytes = b"") -> None:
    subprocess.run([get_ffmpeg_exe(), "-y", "-loglevel", "error", *words], input=data, check=True)
