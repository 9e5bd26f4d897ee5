"""A texel_field of the tests, its lookups, and slow ones to compare them with."""

import numpy as np

from mitex.runtime.upload import upload
from tests.textures.helpers import QUAD

UNIT = (QUAD[:, :2] + 1) / 2  # uv of the quad whose map covers it once


def field(mi, data: np.ndarray, charts: np.ndarray | None = None, **options) -> dict:
    plugin = {"type": "texel_field", "data": upload(mi.TensorXf, np.asarray(data, np.float32))} | options
    return (
        plugin if charts is None else plugin | {"charts": upload(mi.TensorXf, np.asarray(charts, np.float32))}
    )


def at(mi, uv: np.ndarray):
    """Surface interactions with the given (N, 2) uv."""
    si = mi.SurfaceInteraction3f()
    si.uv = mi.Point2f(
        upload(mi.Float, uv[:, 0].astype(np.float32)), upload(mi.Float, uv[:, 1].astype(np.float32))
    )
    return si


def lookups(mi, plugin: dict, uv: np.ndarray) -> np.ndarray:
    """(N, C) values of all channels."""
    texture = mi.load_dict(plugin)
    return np.stack([value.numpy() for value in texture.gather(texture.locate(at(mi, uv)))], axis=1)


def slow_weights(shape: tuple[int, int], uv: np.ndarray, charts=None, nearest: bool = False) -> np.ndarray:
    """(N, H * W) weights of every texel in every lookup, point by point and texel by texel."""
    height, width = shape
    matrix = np.zeros((len(uv), height * width))
    for n, (u, v) in enumerate(np.clip(uv.astype(np.float64), 0, 1)):
        x, y = u * width - 0.5, (1 - v) * height - 0.5
        around = []
        for row in (np.floor(y), np.floor(y) + 1):
            for column in (np.floor(x), np.floor(x) + 1):
                weight = (1 - abs(x - column)) * (1 - abs(y - row))
                r, c = int(np.clip(row, 0, height - 1)), int(np.clip(column, 0, width - 1))
                chart = 0 if charts is None else charts[r, c]
                if chart >= 0:
                    around.append((np.hypot(x - column, y - row), chart, weight, r * width + c))
        if not around:
            continue
        _, own, _, texel = min(around)
        if nearest:
            matrix[n, texel] = 1
            continue
        for _, chart, weight, texel in around:
            if chart == own:
                matrix[n, texel] += weight
        matrix[n] /= matrix[n].sum()
    return matrix
