"""Reference shapes by formula: surfaces with a geometric texture to learn from."""

from __future__ import annotations

import os
from collections.abc import Callable
from pathlib import Path

import numpy as np

from mitex.errors import MeshError
from mitex.geometry.vectors import across, unit
from mitex.mesh import Mesh, embedded_names, icosphere, torus
from mitex.paths import expanded
from mitex.suggestions import suggestion

FREQUENCY = 56  # of the spheres: 62,720 faces
GOLDEN = np.pi * (3.0 - np.sqrt(5.0))


def spikes() -> Mesh:
    """A ball with 90 pointed spikes."""
    angle = _nearest_angle(_spiral(90))
    return _sphere(0.45 * np.clip(1 - angle / 0.17, 0, 1) ** 1.4, "spikes")


def scales() -> Mesh:
    """A ball covered by 140 domed plates with grooves in between."""
    first, second = _two_nearest(_spiral(140))
    inside = np.clip((second - first) / 0.14, 0, 1)  # 0 on the border between two plates
    return _sphere(0.16 * np.sqrt(inside * (2 - inside)), "scales")


def knobs() -> Mesh:
    """A ball with 36 balls on it, more than half of each: they hang over, which no height map can say."""
    points, centres = icosphere(FREQUENCY).vertices.astype(np.float64), _spiral(36)
    index = np.argmax(points @ centres.T, axis=1)
    centre = centres[index]
    angle = np.arccos(np.clip((points * centre).sum(1), -1, 1))
    rim, size, up = 0.29, 0.2, 0.12
    t = np.clip(1 - angle / rim, 0, 1)  # 0 at the foot, 1 at the top
    # Profile: inwards to where the small ball leaves the large one, and over the small one.
    neck = np.arccos(-up / size)
    around = np.interp(t, [0.2, 1.0], [neck, 0.0])
    radius = np.where(t < 0.2, np.interp(t, [0.0, 0.2], [rim, size * np.sin(neck)]), size * np.sin(around))
    height = np.where(t < 0.2, 0.0, up + size * np.cos(around))
    outwards = unit(across(points, centre))
    knob = (np.cos(radius)[:, None] * centre + np.sin(radius)[:, None] * outwards) * (1 + height)[:, None]
    return _mesh(np.where((angle < rim)[:, None], knob, points), "knobs")


def ridges() -> Mesh:
    """A ball with the winding ridges of a brain coral."""
    rng = np.random.default_rng(3)
    points = icosphere(FREQUENCY).vertices.astype(np.float64)
    waves = 20.0 * unit(rng.normal(size=(160, 3)))
    field = np.cos(points @ waves.T + rng.uniform(0, 2 * np.pi, 160)).sum(1) / np.sqrt(80)
    return _sphere(0.14 * (1 + np.tanh(2 * field)), "ridges")


def craters() -> Mesh:
    """A ball with 70 craters, each a bowl with a raised rim."""
    distance = _nearest_angle(_spiral(70)) / 0.17  # in units of a crater's radius
    bowl = np.where(distance < 1, distance**2 - 1, 0.0)
    rim = np.exp(-(((distance - 1.05) / 0.22) ** 2))
    return _sphere(0.17 * bowl + 0.09 * rim, "craters")


def warts() -> Mesh:
    """A torus with 170 round warts: a reference of genus 1."""
    base = torus(256, 112, tube=0.45)
    points = base.vertices.astype(np.float64)
    k = np.arange(170)
    around, across = 2 * np.pi * (k * 0.618034 % 1), 2 * np.pi * (k + 0.5) / 170
    reach = 1 + 0.45 * np.cos(across)
    centres = np.stack([reach * np.sin(around), 0.45 * np.sin(across), reach * np.cos(around)], 1)
    distance = np.linalg.norm(points[:, None] - centres, axis=2).min(1)
    dome = np.sqrt(np.clip(1 - (distance / 0.125) ** 2, 0, 1))
    return Mesh(points + 0.11 * dome[:, None] * base.normals, base.faces, name="warts")


def cactus() -> Mesh:
    """A ball with 10 upright ribs, flatter towards the poles: they follow the field `up`."""
    points = icosphere(FREQUENCY).vertices.astype(np.float64)
    ring = np.hypot(points[:, 0], points[:, 2])
    rib = np.sqrt(np.abs(np.cos(5 * np.arctan2(points[:, 0], points[:, 2]))))  # round, with sharp grooves
    return _sphere(0.3 * ring * rib, "cactus")


def shingles() -> Mesh:
    """A ball with 9 rows of shingles, each thickest at its lower end: they follow the field `down`."""
    points = icosphere(FREQUENCY).vertices.astype(np.float64)
    down = 9 * np.arccos(np.clip(points[:, 1], -1, 1)) / np.pi
    row = np.minimum(np.floor(down), 8)
    count = np.round(18 * np.sin(np.pi * (row + 0.5) / 9))  # shingles of a row
    along = np.arctan2(points[:, 0], points[:, 2]) / (2 * np.pi) * count + 0.5 * (row % 2)
    gap = np.abs(along - np.round(along)) * 2  # 0 in the middle of a gap, 1 on that of a shingle
    return _sphere(0.16 * (down - row) * np.clip(gap / 0.15, 0, 1), "shingles")


def bricks() -> Mesh:
    """A ball with 9 courses of bricks, staggered by half: they follow the field `about-y`, both ways."""
    points = icosphere(FREQUENCY).vertices.astype(np.float64)
    down = 9 * np.arccos(np.clip(points[:, 1], -1, 1)) / np.pi
    row = np.minimum(np.floor(down), 8)
    count = np.maximum(np.round(9 * np.sin(np.pi * (row + 0.5) / 9)), 2)  # bricks of a course
    along = np.arctan2(points[:, 0], points[:, 2]) / (2 * np.pi) * count + 0.5 * (row % 2)
    upright = np.abs(along - np.round(along)) * 2  # 0 in the middle of a joint, 1 on that of a brick
    level = 1 - np.abs(2 * (down - row) - 1)
    return _sphere(0.12 * np.minimum(np.clip(upright / 0.12, 0, 1), np.clip(level / 0.25, 0, 1)), "bricks")


def woven() -> Mesh:
    """A ball of 18 strands that go over and under each other, six by six on each side of a cube around it."""
    points = icosphere(FREQUENCY).vertices.astype(np.float64)
    axes = (np.abs(points).argmax(1)[:, None] + np.arange(3)) % 3
    out, *sides = np.take_along_axis(points, axes, 1).T
    place = 3 + 12 / np.pi * np.arctan(np.stack(sides) / out)  # from 0 to 6 across the strands, both ways
    profile, wave = np.sqrt(1 - (2 * (place % 1) - 1) ** 2), np.sin(np.pi * place)
    along = profile[1] * (1 + 0.6 * wave[0] * np.sign(wave[1]))
    across = profile[0] * (1 - 0.6 * wave[1] * np.sign(wave[0]))
    return _sphere(0.1 * np.maximum(along, across), "woven")


REFERENCES: dict[str, Callable[[], Mesh]] = {
    "spikes": spikes,
    "scales": scales,
    "knobs": knobs,
    "ridges": ridges,
    "craters": craters,
    "warts": warts,
    "cactus": cactus,
    "shingles": shingles,
    "bricks": bricks,
    "woven": woven,
}


def reference_names() -> list[str]:
    """The names that `find_reference` knows: those of shapes by formula, and of embedded meshes."""
    return [*REFERENCES, *embedded_names()]


def find_reference(source: str | Path) -> Mesh:
    """A reference by name, or from a file or embedded mesh as `Mesh.load` finds it.

    Raises:
        MeshError: as `Mesh.load`; for a name that is neither, with the names that there are.
    """
    name, names = str(source), reference_names()
    if name in REFERENCES:
        return REFERENCES[name]()
    if name not in names and not os.path.exists(expanded(source)):
        otherwise = f"give a mesh file, or one of {', '.join(names)}"
        raise MeshError(f"there is no mesh {name}", suggestion(name, names, otherwise))
    return Mesh.load(source)


def _spiral(count: int) -> np.ndarray:
    """(count, 3) directions, evenly spread along a spiral."""
    y = 1 - (2 * np.arange(count) + 1) / count
    angle = GOLDEN * np.arange(count)
    ring = np.sqrt(1 - y * y)
    return np.stack([ring * np.sin(angle), y, ring * np.cos(angle)], 1)


def _angles(centres: np.ndarray) -> np.ndarray:
    return np.arccos(np.clip(icosphere(FREQUENCY).vertices.astype(np.float64) @ centres.T, -1, 1))


def _nearest_angle(centres: np.ndarray) -> np.ndarray:
    """(V,) the angle from each vertex of the sphere to the nearest centre."""
    return _angles(centres).min(1)


def _two_nearest(centres: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    nearest = np.partition(_angles(centres), 1, axis=1)
    return nearest[:, 0], nearest[:, 1]


def _sphere(height: np.ndarray, name: str) -> Mesh:
    points = icosphere(FREQUENCY).vertices.astype(np.float64)
    return _mesh(points * (1 + height)[:, None], name)


def _mesh(points: np.ndarray, name: str) -> Mesh:
    return Mesh(points, icosphere(FREQUENCY).faces, name=name)
