"""Noise that is a function of the place, so that boxes of voxels fit together wherever they are made."""

from __future__ import annotations

import numpy as np

from mitex.methods.baselines.solid_texture.boxes import Box

PRIMES = (0x8DA6B343, 0xD8163841, 0xCB1AB31F)  # of x, y and z
STREAM = 0x9E3779B1  # of seed, scale and channel


def hashed_noise(box: Box, channels: int, scale: int, seed: int) -> np.ndarray:
    """(C, X, Y, Z) float32 uniform in [0, 1), by a hash of the voxels' indices."""
    with np.errstate(over="ignore"):
        total = np.zeros((1, 1, 1), np.uint32)
        for axis, (start, size) in enumerate(zip(box.start, box.size, strict=True)):
            index = np.arange(start, start + size, dtype=np.int64).astype(np.uint32)
            shape = [1, 1, 1]
            shape[axis] = size
            total = total ^ (index * np.uint32(PRIMES[axis])).reshape(shape)
        streams = np.arange(channels, dtype=np.uint32) + np.uint32(channels * scale)
        streams = _mixed(streams * np.uint32(STREAM) ^ _mixed(np.array([seed & 0xFFFFFFFF], np.uint32)))
        values = _mixed(total[None] ^ streams[:, None, None, None])
    return (values >> np.uint32(8)).astype(np.float32) / np.float32(1 << 24)


def _mixed(values: np.ndarray) -> np.ndarray:
    """A bijection of 32-bit integers in which every bit depends on every other (MurmurHash3's last steps)."""
    values = (values ^ (values >> np.uint32(16))) * np.uint32(0x85EBCA6B)
    values = (values ^ (values >> np.uint32(13))) * np.uint32(0xC2B2AE35)
    return values ^ (values >> np.uint32(16))
