"""Levels of a flat grid of texels, made without geodesics, and a flat mesh whose atlas is the identity."""

import numpy as np

from mitex.mesh import Mesh
from mitex.methods.surface.borders import Border
from mitex.methods.surface.levels import POOLS, Level, Levels


def grid_levels(side: int) -> Levels:
    """Of side x side texels (a multiple of 32): what `build` should find away from the border.

    Taps across the border are the opposite ones. Elements are numbered block by block, as `Levels` demands.
    """
    place = _blocks(side, POOLS)  # (N, 2) row, column of each element
    levels = []
    for n in range(POOLS):
        width = side >> n
        here = place[:: 4**n] >> n
        number = np.empty((width, width), np.int64)
        number[tuple(here.T)] = np.arange(len(here))
        taps = np.empty((len(here), 9), np.int32)
        for tap in range(9):
            offset = np.array(divmod(tap, 3)) - 1
            there = here + offset
            outside = ((there < 0) | (there >= width)).any(1)
            there[outside] = (here - offset)[outside]
            inside = ((there >= 0) & (there < width)).all(1)
            there[~inside] = here[~inside]
            taps[:, tap] = number[tuple(there.T)]
        levels.append(Level(taps, np.full(len(here) // 4, 4, np.int32)))
    return Levels(
        order=(place[:, 0] * side + place[:, 1]).astype(np.int32),
        position=np.pad(place[:, ::-1] * [1.0, -1.0], ((0, 0), (0, 1))).astype(np.float32),
        lookup=levels[0].nearest,
        spread=Border.none(side * side).spread[place[:, 0] * side + place[:, 1]].T.tocsr(),
        levels=tuple(levels),
    )


def _blocks(side: int, depth: int) -> np.ndarray:
    """(N, 2) places in Morton order within blocks of 2^depth, the blocks row by row."""
    row, column = np.divmod(np.arange(side * side), side)
    key = (row >> depth) * (side >> depth) + (column >> depth)
    for bit in reversed(range(depth)):
        key = key * 4 + ((row >> bit) & 1) * 2 + ((column >> bit) & 1)
    ranked = np.argsort(key)
    return np.stack([row[ranked], column[ranked]], 1)


def flat_square(columns: int) -> Mesh:
    """[0, 1]^2 in the plane z = 0, seen from +z; its UVs are x and y. Inner vertices are moved at random."""
    x, y = np.meshgrid(np.linspace(0, 1, columns + 1), np.linspace(0, 1, columns + 1))
    moved = np.random.default_rng(0).uniform(-0.3, 0.3, (2, columns - 1, columns - 1)) / columns
    x[1:-1, 1:-1] += moved[0]
    y[1:-1, 1:-1] += moved[1]
    a = (np.arange(columns)[:, None] * (columns + 1) + np.arange(columns)).ravel()
    b, c, d = a + 1, a + columns + 1, a + columns + 2
    faces = np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
    points = np.stack([x.ravel(), y.ravel(), 0 * x.ravel()], 1)
    return Mesh(points, faces, points[faces][..., :2], "square")
