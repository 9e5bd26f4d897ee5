"""Polygon meshes with hard edges and UVs, as modellers write them to OBJ files."""

from dataclasses import dataclass

import numpy as np

CUBE = [[x, y, z] for x in (-1, 1) for y in (-1, 1) for z in (-1, 1)]
SQUARES = [[0, 1, 3, 2], [4, 6, 7, 5], [0, 4, 5, 1], [2, 3, 7, 6], [0, 2, 6, 4], [1, 5, 7, 3]]
QUAD = np.array([[0.0, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]])


@dataclass
class Solid:
    """Positions (V, 3), polygons as lists of vertices, and per polygon UVs (n, 2) and normals (n, 3)."""

    points: np.ndarray
    polygons: list[list[int]]
    uv: list[np.ndarray]
    normals: list[np.ndarray]

    def obj(self) -> str:
        """A file with a `vt` and a `vn` for each polygon corner."""
        lines = [f"v {x!r} {y!r} {z!r}" for x, y, z in np.float32(self.points).astype(float).tolist()]
        lines += [f"vt {u!r} {v!r}" for u, v in np.float32(np.concatenate(self.uv)).astype(float).tolist()]
        lines += [f"vn {x!r} {y!r} {z!r}" for x, y, z in np.concatenate(self.normals).tolist()]
        n = 0
        for polygon in self.polygons:
            lines.append("f " + " ".join(f"{v + 1}/{n + k + 1}/{n + k + 1}" for k, v in enumerate(polygon)))
            n += len(polygon)
        return "\n".join(lines) + "\n"


def solid(points, polygons, smooth: bool = False) -> Solid:
    """A closed solid around the origin: flat or smooth, every polygon with a place of its own in the UVs."""
    points = np.array(points, float)
    side = int(np.ceil(np.sqrt(len(polygons))))
    uv, normals = [], []
    for k, polygon in enumerate(polygons):
        ring = points[polygon]
        normal = np.cross(ring, np.roll(ring, -1, axis=0)).sum(axis=0)
        normals.append(ring if smooth else np.tile(normal, (len(polygon), 1)))
        angle = 2 * np.pi * np.arange(len(polygon)) / len(polygon)
        circle = 0.5 + 0.45 * np.stack([np.cos(angle), np.sin(angle)], axis=1)
        uv.append((circle + np.array(divmod(k, side)[::-1])) / side)
    normals = [n / np.linalg.norm(n, axis=1, keepdims=True) for n in normals]
    return Solid(points, [list(p) for p in polygons], uv, normals)


def cube(smooth: bool = False) -> Solid:
    """Eight vertices, six squares."""
    return solid(CUBE, SQUARES, smooth)


def mirrored_cube() -> Solid:
    """Half of its charts are mirrored."""
    result = cube()
    result.uv = [uv[::-1] if k % 2 else uv for k, uv in enumerate(result.uv)]
    return result


def prism(sides: int = 7) -> Solid:
    """Two polygons of many corners and quads between them."""
    angle = 2 * np.pi * np.arange(sides) / sides
    ring = np.stack([np.cos(angle), np.sin(angle)], axis=1)
    points = np.concatenate([np.column_stack([ring, np.full(sides, z)]) for z in (-0.5, 0.5)])
    k = np.arange(sides)
    quads = np.stack([k, np.roll(k, -1), np.roll(k, -1) + sides, k + sides], axis=1).tolist()
    return solid(points, [k[::-1].tolist(), *quads, (k + sides).tolist()])


def quad_sphere(side: int = 4) -> Solid:
    """A cube's squares in `side`^2 quads each, on the unit sphere, smooth."""
    steps = np.linspace(-1, 1, side + 1)
    places: dict[tuple, int] = {}
    quads = []
    for axis in range(3):
        for sign in (-1, 1):
            for i in range(side):
                for j in range(side):
                    quad = []
                    for a, b in ((i, j), (i + 1, j), (i + 1, j + 1), (i, j + 1))[::sign]:
                        point = np.roll([sign, steps[a], steps[b]], axis)
                        quad.append(places.setdefault(tuple(point.tolist()), len(places)))
                    quads.append(quad)
    points = np.array(list(places))
    return solid(points / np.linalg.norm(points, axis=1, keepdims=True), quads, smooth=True)


def mixed() -> Solid:
    """A house: flat walls of quads, a roof of triangles whose edges are smooth."""
    points = [*CUBE, [0, 2, 0]]
    roof = [[a, b, 8] for a, b in ((2, 3), (3, 7), (7, 6), (6, 2))]
    result = solid(points, [s for s in SQUARES if s != [2, 3, 7, 6]] + roof)
    for k, polygon in enumerate(result.polygons):
        if len(polygon) == 3:
            out = np.array(points)[polygon] * [1.0, 0.5, 1.0] + [0.0, 0.3, 0.0]
            result.normals[k] = out / np.linalg.norm(out, axis=1, keepdims=True)
    return result


SOLIDS = {
    "flat cube": cube(),
    "smooth cube": cube(smooth=True),
    "quad sphere": quad_sphere(),
    "prism": prism(),
    "mirrored": mirrored_cube(),
    "mixed": mixed(),
}
