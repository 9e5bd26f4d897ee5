"""Arrays as the page's data holds them."""

from __future__ import annotations

import base64
import zlib

import numpy as np

KINDS = ("float32", "float64", "uint8", "uint16", "uint32", "int32")


def packed(values: np.ndarray) -> dict[str, str]:
    """An array of one of `KINDS` as JSON values: its numbers row by row, little-endian, deflated, base64."""
    if values.dtype.name not in KINDS:
        raise TypeError(f"an array of {values.dtype}")
    bytes_ = np.ascontiguousarray(values).astype(values.dtype.newbyteorder("<")).tobytes()
    deflate = zlib.compressobj(9, zlib.DEFLATED, -zlib.MAX_WBITS)
    return {
        "kind": values.dtype.name,
        "bytes": base64.b64encode(deflate.compress(bytes_) + deflate.flush()).decode(),
    }


def differences(rows: np.ndarray) -> np.ndarray:
    """Unsigned integers (N, C) as differences from the row before, modulo their range; small ones deflate
    well.
    """
    out = rows.copy()
    out[1:] -= rows[:-1]
    return out
