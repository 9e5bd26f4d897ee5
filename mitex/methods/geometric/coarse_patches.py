"""Patches of a coarse relief. They take seconds, so those of a finished model are kept in the cache."""

from __future__ import annotations

from functools import partial
from pathlib import Path

import numpy as np

from mitex.cache import cached, content_key
from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.paths import cache_dir
from mitex.quilting.matching import ArraySource
from mitex.quilting.vertices import vertex_patches

PATCH = 16  # side of a patch [mean edges]
SHARE = 0.34  # of the side of a square as large as the mesh, at most
RATE = 2  # texels of a patch on an edge
PLACES = 250  # that patches are taken at
VERSION = "1"  # part of the keys; to be raised when patches are taken in another way


def height_patches(base: Mesh, heights: np.ndarray, right: np.ndarray | None, turns: int) -> ArraySource:
    """Squares of heights [mean edges].

    Args:
        base: V vertices.
        heights: (V,) above it [mesh units].
        right: (V, 3) where a patch's right shall point; None for anywhere.
        turns: directions in which each is taken.

    Raises:
        ConfigError: none fits on the base.
    """
    edge = float(base.edge_lengths.mean())
    side = min(PATCH * edge, SHARE * float(base.face_areas.sum()) ** 0.5)
    size = 8 * max(round(side / edge * RATE / 8), 1)
    values, rng = (heights / edge)[:, None], np.random.default_rng(0)
    patches = vertex_patches(base, values, size, edge / RATE, PLACES, turns, rng, right)
    if not len(patches.values):
        raise ConfigError(
            f"no square {size // RATE} edges wide lies flat on {base.name}",
            "begin on a higher level (`first_level`)",
        )
    return patches


def cached_patches(base: Mesh, heights: np.ndarray, right: np.ndarray | None, turns: int) -> ArraySource:
    """As `height_patches`, from the cache if they are there (`mitex.cache.cached`)."""
    given = base.vertices, base.faces, heights, *([] if right is None else [right])
    key = content_key(VERSION, *given, (turns, PLACES))
    compute = partial(height_patches, base, heights, right, turns)
    return cached(cache_dir() / "geometric" / key, compute, _read, _write)


def _read(place: Path) -> ArraySource:
    values, centres = (np.load(place / f"{name}.npy", allow_pickle=False) for name in ("values", "centres"))
    return ArraySource(values, centres, float(values.shape[1]))


def _write(folder: Path, patches: ArraySource) -> None:
    for name in ("values", "centres"):
        np.save(folder / f"{name}.npy", getattr(patches, name), allow_pickle=False)
