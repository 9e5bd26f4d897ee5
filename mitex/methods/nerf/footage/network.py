"""A network that masks the object, from an ONNX file that the user names, run by OpenCV."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path

import cv2
import numpy as np

from mitex.errors import ConfigError, WeightsError
from mitex.features.normalisation import MEAN, SPREAD
from mitex.methods.nerf.footage.mask_method import NetworkFile
from mitex.methods.nerf.footage.onnx_file import declared
from mitex.paths import expanded
from mitex.reading import LONGEST, content, reading

MOST_BYTES = 1 << 30
SIDE = 320  # of the pictures of a network that takes any, as U2-Net has it [pixels]
NEED = "name a network that makes one mask of one picture, as one ONNX file with its weights"
SURE = 0.25  # how far parts may lie outside [0, 1]; logits lie farther
TRIAL = """
import sys, cv2, numpy
path, output, height, width = sys.argv[1:]
net = cv2.dnn.readNetFromONNX(numpy.fromfile(path, numpy.uint8))
net.setInput(numpy.zeros((1, 3, int(height), int(width)), numpy.float32))
net.forward(output)
"""


@dataclass(frozen=True, eq=False)
class Network:
    """A network that tells the object from its surroundings, picture by picture.

    Attributes:
        path: of its file, for messages.
        net: OpenCV's network.
        output: the name of the output that is the mask.
        size: (height, width) of the pictures that it takes [pixels].
        mean, spread: (3,) or () float64, subtracted from sRGB in [0, 1], and what that is divided by.
    """

    path: Path
    net: cv2.dnn.Net
    output: str
    size: tuple[int, int]
    mean: np.ndarray
    spread: np.ndarray

    def __call__(self, picture: np.ndarray) -> np.ndarray:
        """What it says of a picture (H, W, 3) uint8 sRGB, which it sees stretched to its size.

        Returns:
            (H, W) float32 in the network's own units, more where the object is.

        Raises:
            WeightsError: it cannot be run, or gives no mask.
        """
        small = cv2.resize(picture, self.size[::-1], interpolation=cv2.INTER_AREA)
        values = ((small / 255.0 - self.mean) / self.spread).astype(np.float32)
        with _opencv(self.path):
            self.net.setInput(np.ascontiguousarray(values.transpose(2, 0, 1)[None]))
            answer = np.asarray(self.net.forward(self.output))
        if answer.ndim != 4 or answer.shape[:2] != (1, 1):
            shape = " x ".join(map(str, answer.shape))
            raise WeightsError(f"'{self.path}' gives {shape} numbers, no mask 1 x 1 x H x W", NEED)
        if not np.isfinite(answer).all():
            raise WeightsError(f"'{self.path}' gives values that are not finite", NEED)
        return cv2.resize(answer[0, 0].astype(np.float32), picture.shape[1::-1])


def read_network(file: NetworkFile) -> Network:
    """A network that was found to give a mask of a black picture.

    Raises:
        ConfigError: a size is asked for that it does not take.
        WeightsError: the file is missing, larger than 1 GiB, or no ONNX file of a network that makes one
            mask of one picture; or OpenCV cannot run it.
    """
    path = expanded(file.path)
    with reading(path, WeightsError, NEED, "cannot be used"):
        data = content(path, MOST_BYTES)
        head = declared(data)
    side = file.side or SIDE
    size = head.height or side, head.width or side
    if file.side and size != (side, side):
        raise ConfigError(f"'{path}' takes pictures of {size[1]} x {size[0]} only", f"leave out ',{side}'")
    _try(path, head.output, size)
    with _opencv(path):
        net = cv2.dnn.readNetFromONNX(np.frombuffer(data, np.uint8))
    mean, spread = file.colours or (MEAN, SPREAD)
    network = Network(path, net, head.output, size, np.array(mean), np.array(spread))
    network(np.zeros((*size, 3), np.uint8))
    return network


def half(low: float, high: float) -> float:
    """The value above which a network calls a pixel the object, which is one half of a part in [0, 1].

    Args:
        low, high: of all that it said: within [0, 1]; of logits, which are 0 at one half; or of another
            range from 0 upwards, whose largest value then means the whole.
    """
    if low < -SURE:
        return 0.0
    return 0.5 * high if high > 1.0 + SURE else 0.5


def _try(path: Path, output: str, size: tuple[int, int]) -> None:
    """Runs a network in a process of its own: some damaged files make OpenCV crash."""
    words = [sys.executable or "python3", "-P", "-c", TRIAL, str(path), output, *map(str, size)]
    if subprocess.run(words, stdin=subprocess.DEVNULL, capture_output=True).returncode < 0:
        raise WeightsError(f"'{path}' makes OpenCV crash", NEED)


@contextmanager
def _opencv(path: Path) -> Iterator[None]:
    """Within it, OpenCV says nothing by itself, and its complaints are errors that name the file."""
    level = cv2.utils.logging.getLogLevel()
    cv2.utils.logging.setLogLevel(cv2.utils.logging.LOG_LEVEL_SILENT)
    try:
        yield
    except (cv2.error, MemoryError) as error:
        why = " ".join(str(getattr(error, "err", error)).split()).split("error: ")[-1].strip("> ")[:LONGEST]
        raise WeightsError(f"OpenCV cannot run '{path}' ({why})", NEED) from error
    finally:
        cv2.utils.logging.setLogLevel(level)
