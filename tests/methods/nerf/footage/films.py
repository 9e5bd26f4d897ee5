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
