"""Makes the meshes that ship with Mitex from formulas; needs the extra `remesh`, takes minutes.

    python tools/make_meshes.py [NAME ...]

Each shape is a signed distance (more or less): its zero set is traced on a grid, remeshed to nearly
equilateral triangles, evened out, and put back exactly onto the zero set. The vase is
open: a swept profile, remeshed.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
from mesh_kit import Field, cone, disc, ellipsoid, relax, smooth_cut, smooth_union, solid, tube
from scipy.interpolate import splev, splprep

from mitex.mesh import Mesh, quality, remesh
from mitex.paths import atomic_write

OUT = Path(__file__).parents[1] / "mitex" / "data" / "meshes"

LICENSE = """\
The meshes in this folder were made by tools/make_meshes.py of Mitex, from formulas alone.

To the extent possible under law, the Mitex authors have waived all copyright and related or neighbouring
rights to them: CC0 1.0 Universal, https://creativecommons.org/publicdomain/zero/1.0/
"""


def knot() -> Field:
    """A trefoil: the (2, 3) torus knot as a thick tube, genus 1."""
    t = np.linspace(0.0, 2.0 * np.pi, 4000, endpoint=False)
    reach = 1.0 + 0.42 * np.cos(3.0 * t)
    path = np.stack([reach * np.cos(2.0 * t), reach * np.sin(2.0 * t), -0.52 * np.sin(3.0 * t)], axis=1)
    return tube(path, np.full(len(path), 0.27), closed=True)


def octopus() -> Field:
    """A mantle that leans back, two eyes, and eight arms that run over the floor and curl at their tips."""
    arms = [tube(*_arm(k)) for k in range(8)]

    def field(p: np.ndarray) -> np.ndarray:
        mantle = cone(p, np.array([0.0, 0.26, -0.02]), np.array([0.0, 0.72, -0.30]), 0.44, 0.54)
        body = smooth_union(mantle, ellipsoid(p, (0.0, -0.20, 0.0), (0.36, 0.30, 0.36)), 0.35)
        for side in (-1.0, 1.0):
            body = smooth_union(body, ellipsoid(p, (0.29 * side, 0.22, 0.36), (0.15, 0.16, 0.14)), 0.09)
        for arm in arms:
            body = smooth_union(body, arm(p), 0.24)
        return body

    return field


def _arm(k: int) -> tuple[np.ndarray, np.ndarray]:
    """Path (n, 3) and radii (n,) of one arm, steered: a lazy bend, then ever tighter the other way."""
    count = 400
    s = np.linspace(0.0, 1.0, count)
    length = 1.72 + 0.10 * np.sin(2.1 * k + 0.4)
    bend = -0.9 * np.sin(np.pi * np.minimum(s / 0.55, 1.0)) + 17.5 * np.maximum(s - 0.46, 0.0) ** 1.25
    heading = 2.0 * np.pi * (k + 0.5) / 8.0 + np.cumsum(bend) * length / count
    x = 0.16 * np.sin(heading[0]) + np.cumsum(np.sin(heading)) * length / count
    z = 0.16 * np.cos(heading[0]) + np.cumsum(np.cos(heading)) * length / count
    down = np.clip(s / 0.38, 0.0, 1.0)
    lift = (0.16 + 0.12 * np.cos(1.9 * k)) * np.maximum(s - 0.45, 0.0) / 0.55
    y = -0.22 - 0.50 * (3.0 * down**2 - 2.0 * down**3) + lift
    return np.stack([x, y, z], axis=1), 0.22 * (1.0 - s) ** 0.8 + 0.058


def shaderball() -> Field:
    """What material artists look at: a ball with a groove that shows a core, on a foot."""
    axis = np.array([0.60, 0.70, 0.39]) / np.linalg.norm([0.60, 0.70, 0.39])

    def field(p: np.ndarray) -> np.ndarray:
        q = p - (0.0, 0.22, 0.0)
        ball = np.linalg.norm(q, axis=1)
        along = q @ axis
        groove = np.abs(along) - 0.14
        shell = smooth_cut(ball - 1.0, smooth_cut(groove, ball - 0.76, 0.30), 0.20)
        neck = disc(p, (0.0, -0.95, 0.0), 0.42, 0.25, 0.05)
        foot = disc(p, (0.0, -1.16, 0.0), 0.80, 0.11, 0.06)
        return smooth_union(smooth_union(shell, neck, 0.12), foot, 0.16)

    return field


def mushrooms() -> Field:
    """A large mushroom and a small one on a mound."""

    def mushroom(p: np.ndarray, foot: tuple, top: tuple, size: float) -> np.ndarray:
        stem = cone(p, np.array(foot), np.array(top), 0.30 * size, 0.19 * size)
        q = p - top
        cap = ellipsoid(q, (0.0, 0.02 * size, 0.0), (0.86 * size, 0.62 * size, 0.86 * size))
        hollow = ellipsoid(q, (0.0, -0.44 * size, 0.0), (0.98 * size, 0.62 * size, 0.98 * size))
        return smooth_union(smooth_cut(cap, hollow, 0.30 * size), stem, 0.25 * size)

    def field(p: np.ndarray) -> np.ndarray:
        large = mushroom(p, (0.0, -0.90, 0.0), (-0.10, 0.25, -0.04), 1.0)
        small = mushroom(p, (0.42, -0.92, 0.32), (0.70, -0.28, 0.54), 0.58)
        mound = ellipsoid(p, (0.16, -1.02, 0.12), (0.66, 0.20, 0.58))
        return smooth_union(smooth_union(large, small, 0.15), mound, 0.45)

    return field


def vase() -> Mesh:
    """A fluted vase with a lip, open inside its neck."""
    # Control points (radius, height) of the profile, from the middle of the foot over the lip into the neck.
    control = np.array(
        [
            [0.00, -1.00], [0.20, -1.00], [0.34, -1.00], [0.41, -0.96], [0.41, -0.88], [0.44, -0.76],
            [0.57, -0.50], [0.69, -0.15], [0.68, 0.18], [0.54, 0.46], [0.39, 0.66], [0.355, 0.80],
            [0.41, 0.93], [0.455, 0.99], [0.44, 1.06], [0.37, 1.08], [0.31, 1.03], [0.27, 0.93],
            [0.25, 0.80], [0.26, 0.68], [0.33, 0.52],
        ]
    )  # fmt: skip
    profile = _spline(control, 400)
    rows, columns = len(profile), 360
    angle = 2.0 * np.pi * np.arange(columns) / columns
    outside = np.arange(rows) < np.argmax(profile[:, 1])
    height = profile[:, 1]
    # Flutes that wind up the belly and fade out towards foot and neck.
    depth = 0.05 * np.where(outside, np.exp(-(((height + 0.12) / 0.42) ** 4)), 0.0)
    wave = np.cos(11.0 * (angle[None, :] + 0.55 * height[:, None]))
    radius = profile[:, 0, None] * (1.0 + depth[:, None] * wave)
    points = np.stack(
        [radius * np.sin(angle), np.repeat(height[:, None], columns, axis=1), radius * np.cos(angle)], axis=2
    )[1:].reshape(-1, 3)
    i, j = np.divmod(np.arange((rows - 2) * columns), columns)
    a, b = i * columns + j, i * columns + (j + 1) % columns
    c, d = b + columns, a + columns
    pole = np.full(columns, len(points))
    first = np.arange(columns)
    faces = np.concatenate(
        [
            np.stack([a, b, c], axis=1),
            np.stack([a, c, d], axis=1),
            np.stack([pole, (first + 1) % columns, first], axis=1),
        ]
    )
    return Mesh(np.concatenate([points, [[0.0, height[0], 0.0]]]), faces, name="vase")


def _spline(control: np.ndarray, count: int) -> np.ndarray:
    """Points at equal distances along a cubic B-spline that starts and ends at the outer control points."""
    (knots, coefficients, degree), _ = splprep(control.T, s=0.0004)
    dense = np.stack(splev(np.linspace(0.0, 1.0, 20_000), (knots, coefficients, degree)), axis=1)
    dense[:, 0] = np.maximum(dense[:, 0], 0.0)
    length = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(dense, axis=0), axis=1))])
    where = np.linspace(0.0, length[-1], count)
    return np.stack([np.interp(where, length, dense[:, k]) for k in range(2)], axis=1)


SHAPES: dict[str, Callable[[], Mesh]] = {
    "knot": lambda: solid("knot", knot(), ((-1.8, -1.8, -0.9), (1.8, 1.8, 0.9)), 10_000),
    "mushrooms": lambda: solid("mushrooms", mushrooms(), ((-1.3, -1.4, -1.3), (1.5, 1.2, 1.4)), 12_000),
    "octopus": lambda: solid("octopus", octopus(), ((-1.75, -1.05, -1.75), (1.75, 1.4, 1.75)), 14_000, 150),
    "shaderball": lambda: solid(
        "shaderball", shaderball(), ((-1.2, -1.4, -1.2), (1.2, 1.4, 1.2)), 12_000, 110
    ),
    "vase": lambda: relax(remesh(vase(), 10_000, feature_angle=180.0), None, 3),
}


def write_ply(mesh: Mesh, path: Path) -> None:
    """Binary PLY, with 16-bit indices."""
    header = (
        "ply\nformat binary_little_endian 1.0\ncomment made by Mitex tools/make_meshes.py, CC0 1.0\n"
        f"element vertex {len(mesh.vertices)}\nproperty float x\nproperty float y\nproperty float z\n"
        f"element face {len(mesh.faces)}\nproperty list uchar ushort vertex_indices\nend_header\n"
    )
    rows = np.empty(len(mesh.faces), np.dtype([("size", "u1"), ("corners", "<u2", (3,))]))
    rows["size"], rows["corners"] = 3, mesh.faces
    with atomic_write(path) as temporary:
        temporary.write_bytes(header.encode() + mesh.vertices.astype("<f4").tobytes() + rows.tobytes())


def main() -> None:
    for name in sys.argv[1:] or SHAPES:
        mesh = SHAPES[name]().normalised()[0]
        write_ply(mesh, OUT / f"{name}.ply")
        report = quality(mesh)
        print(
            f"{name}: {report.vertices} vertices, {report.faces} faces, genus {report.genus}, "
            f"{report.boundary_edges} boundary edges, valence {report.valence}, "
            f"odd {report.odd_valence:.2%}, edge length varies by {report.edge_variation:.1%}, "
            f"components {report.components}"
        )
    with atomic_write(OUT / "LICENSE.txt") as temporary:
        temporary.write_text(LICENSE)


if __name__ == "__main__":
    main()
