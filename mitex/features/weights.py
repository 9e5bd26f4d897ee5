"""Where the weights of frozen networks are, and whether they are the right ones."""

from __future__ import annotations

import hashlib
import os
from functools import cache
from pathlib import Path

from mitex.errors import WeightsError

VGG16_FILE = "vgg16_conv_fp16.safetensors"
VGG16_SHA256 = "bb5788b61d3a34c37ba2a93772a503da31be4676f46e9bc45243f09542557316"
FLOW_FILE = "flow.safetensors"
FLOW_SHA256 = "cd69fffabcc5fd97d1d9f64742aa4644ce1a3666866a906cda6bbc3a1b5e9914"
WORDS_FILE = "words.safetensors"
WORDS_SHA256 = "6dd05ed322f01ed55f8f60d7462faaec72617cb3ecf29ac79cca0cb15d6b59fd"
FOLDER = Path(__file__).parents[1] / "data" / "weights"


def vgg16_path() -> Path:
    """The VGG-16 weights: `MITEX_VGG16` if set, else the file that ships with the package.

    Raises:
        WeightsError: the file is missing.
    """
    path = Path(os.environ.get("MITEX_VGG16") or FOLDER / VGG16_FILE)
    if not path.is_file():
        raise WeightsError(f"the VGG-16 weights are not at {path}", "reinstall mitex or unset MITEX_VGG16")
    return path


def shipped(file: str) -> Path:
    """Weights that ship with the package and cannot be replaced: `FLOW_FILE` or `WORDS_FILE`.

    Raises:
        WeightsError: the file is missing.
    """
    path = FOLDER / file
    if not path.is_file():
        raise WeightsError(f"the weights are not at {path}", "reinstall mitex")
    return path


@cache
def verify(path: Path, sha256: str) -> None:
    """Compares a file's SHA-256 with the published one, once a process.

    Raises:
        WeightsError: the file differs, or cannot be read.
    """
    try:
        with path.open("rb") as file:
            digest = hashlib.file_digest(file, "sha256").hexdigest()
    except OSError as e:
        raise WeightsError(f"cannot read {path} ({e.strerror})", "check its permissions") from e
    if digest != sha256:
        raise WeightsError(
            f"{path} is not the expected file (SHA-256 {digest[:12]}…)", "reinstall mitex or replace it"
        )
