"""A machine part with sharp creases: a hexagon nut with a flange and a bore."""

from __future__ import annotations

import numpy as np

from mitex.mesh import Mesh

SIDES, COLUMNS = 6, 16  # of the hexagon, and of vertices along one of its sides
GAP = 0.06  # between rows of vertices, at most


def flanged_nut() -> Mesh:
    """The nut, upright, about 2.5 wide and 1 high; each of its smooth surfaces has vertices of its own."""
    turn = np.arange(SIDES * COLUMNS + 1) * (2 * np.pi / (SIDES * COLUMNS))
    circle = np.stack([np.cos(turn), 0 * turn, -np.sin(turn)], axis=1)
    corner = np.pi / SIDES
    hexagon = 0.86 * circle * (np.cos(corner) / np.cos(turn % (2 * corner) - corner))[:, None]
    bore, flange, up = 0.45 * circle, 1.25 * circle, np.array([0.0, 1.0, 0.0])
    step = 0.28 * up
    rings = [bore, flange, flange + step, hexagon + step, hexagon + up, bore + up, bore]
    parts = []
    for k, (first, second) in enumerate(zip(rings[:-1], rings[1:], strict=True)):
        count = SIDES if k == 3 else 1  # the sides of the hexagon are surfaces of their own
        for side in range(count):
            columns = slice(side * COLUMNS, (side + SIDES // count) * COLUMNS + 1)
            parts.append(_strip(first[columns], second[columns]))
    starts = np.cumsum([0, *(len(vertices) for vertices, _ in parts)])
    vertices = np.concatenate([vertices for vertices, _ in parts]) - 0.5 * up
    faces = np.concatenate([f + start for (_, f), start in zip(parts, starts, strict=False)])
    return Mesh(vertices.astype(np.float32), faces, name="nut")


def _strip(first: np.ndarray, second: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """Vertices and faces between two rows of N points; rows that close share their ends."""
    closed = np.allclose(first[0], first[-1])
    columns = len(first) - closed
    rows = 1 + max(round(float(np.linalg.norm(second - first, axis=1).max()) / GAP), 1)
    share = np.linspace(0, 1, rows)[:, None, None]
    vertices = ((1 - share) * first + share * second)[:, :columns].reshape(-1, 3)
    number = np.arange(rows * columns).reshape(rows, columns)
    left = number if closed else number[:, :-1]
    right = np.roll(number, -1, axis=1) if closed else number[:, 1:]
    a, b, c, d = (x.ravel() for x in (left[:-1], right[:-1], left[1:], right[1:]))
    return vertices, np.concatenate([np.stack([a, b, d], 1), np.stack([a, d, c], 1)])
