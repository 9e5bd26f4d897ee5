"""Arrays of a page's data, read with Python."""

import base64
import zlib

import numpy as np


def unpacked(data: dict[str, str]) -> np.ndarray:
    """An array, flat, from what `mitex.page.packed` returned."""
    return np.frombuffer(zlib.decompress(base64.b64decode(data["bytes"]), -15), data["kind"])
