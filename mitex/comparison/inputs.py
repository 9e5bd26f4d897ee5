"""What several pairs share and a comparison reads once, and pictures of it."""

from __future__ import annotations

from collections.abc import Callable
from functools import cache
from typing import Any, TypeVar

import numpy as np

from mitex.asset import Asset
from mitex.mesh import Mesh
from mitex.render.picture import AZIMUTH, ELEVATION, tone
from mitex.render.renderer import OrbitRenderer

Value = TypeVar("Value")

CELL, SPP = 384, 64  # side of a picture [px], and rays of each pixel


_caches: list[Any] = []


def read_once(function: Callable[[str], Value]) -> Callable[[str], Value]:
    """A function that remembers what it has read, until the next comparison begins."""
    remembering = cache(function)
    _caches.append(remembering)
    return remembering


def forget() -> None:
    """Lets everything be read anew: files may have changed."""
    for remembering in _caches:
        remembering.cache_clear()


@read_once
def mesh_of(name: str) -> Mesh:
    """A mesh by its path or name.

    Raises:
        MeshError: It cannot be read.
    """
    return Mesh.load(name)


def lit_picture(asset: Asset, like: Mesh | None = None) -> np.ndarray:
    """(CELL, CELL, 3) sRGB in [0, 1]: an asset in light, path-traced, framed as the mesh `like`."""
    renderer = OrbitRenderer(asset, resolution=CELL, like=like)
    return tone(renderer.render(AZIMUTH, renderer.fit_view(AZIMUTH, ELEVATION), SPP))
