"""Renders captures of objects with a known meso-structure, in the layout of NeRF-synthetic; needs minutes.

    python tools/make_captures.py [--out DIR] [--views N] [--resolution PX] [--spp N] [--seed N] [NAME ...]

DIR/NAME then holds `transforms.json` with cameras and light, `images/*.png` with alpha, `truth/*.npz` with
depth and normal of every pixel, and `base.obj`, the shape below the meso-structure. Every kind is one
function that returns its base and what stands on it, as triangles with colours at their vertices.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from capture_kit import Base, Part, cells, joined, lattice, noise, repeated, ribbon
from capture_studio import write_capture
from exemplar_kit import mix, ramp, step

from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh, icosphere

OUT = Path(__file__).parents[1] / "out" / "captures"
ROCKS = (
    ("4b4e53", "77797a", "a9a59d"),  # granite
    ("2b3036", "454d55", "6d757b"),  # basalt
    ("6b5237", "9a7a52", "cdb58a"),  # sandstone
    ("54302a", "82503f", "b08468"),  # porphyry
)


def durian(rng: np.random.Generator) -> tuple[Base, Part]:
    """A fruit with pointed spikes, each on its own foot, that lean a little."""
    base = Base(lambda d: _lumpy(d, (0.78, 0.80, 0.92), 0.03))
    spacing, rings, sides = 0.118, 18, 30
    points = base.spread(rng, spacing)
    count = len(points)
    frames = base.frames(points)
    angles = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    t = np.linspace(0.0, 1.0, rings)[None, :, None] ** 1.2  # from the foot to the tip
    q = 1.05 * (1.0 - t)

    foot = cells(points, frames, angles, 0.05)[:, None]
    outline = foot + 0.75 * step(0.0, 0.9, t) * (foot.mean(axis=2, keepdims=True) - foot)  # rounder above
    waves = np.sin(7.0 * angles + rng.uniform(0, 6.3, (count, 1, 1)))
    radius = outline * q * (1.0 + 0.05 * waves * step(0.1, 0.5, t) * (1 - t))
    tall = spacing * rng.uniform(0.88, 1.16, (count, 1, 1))
    height = tall * np.maximum(1.0 - q, 0.0) ** 1.5 - 0.02 * (q > 1.0)
    lean = 0.16 * spacing * rng.normal(size=(count, 2))
    x = radius * np.cos(angles) + lean[:, :1, None] * t**1.5
    y = radius * np.sin(angles) + lean[:, 1:, None] * t**1.5
    lifted = base.lift(points, frames, np.stack([x, y, np.broadcast_to(height, x.shape)], axis=-1))
    mesh = repeated(lifted.reshape(count, -1, 3), lattice(rings, sides, closed=True))

    along = np.broadcast_to(t, radius.shape).reshape(-1)
    around = np.broadcast_to(angles, radius.shape).reshape(-1)
    spike = np.repeat(np.arange(count), radius[0].size)
    streaks = noise(rng, np.stack([3.0 * spike, 2.5 * around], axis=1), 1.0)
    ripe = np.clip(0.45 + 0.26 * rng.normal(size=count) + 0.12 * noise(rng, points, 0.5), 0.0, 1.0)[spike]
    skin = mix(ramp(along, "8a8442", "5f7420", "86923a"), ramp(along, "b99c50", "a08a34", "c2ad58"), ripe)
    wood = ramp(rng.random(count), "4a2f16", "8a6234")[spike]
    worn = step(0.55, 0.95, along + 0.09 * rng.normal(size=count)[spike])
    colours = mix(skin, wood, 0.85 * worn)
    colours *= (1.0 + 0.10 * streaks + 0.06 * noise(rng, mesh.vertices, 0.02))[:, None]
    return base, Part(mesh, np.clip(colours, 0.0, 1.0), 0.36 + 0.25 * along)


def grass(rng: np.random.Generator) -> tuple[Base, Part]:
    """Short, thick blades, seen from near: they stand upright, and the soil shows between them."""
    base = _mound()
    turn = np.linspace(0.0, 2.0 * np.pi, 10, endpoint=False)
    blades = Blades(
        length=0.11,
        half_width=(0.0208, 0.0325),
        lean=0.2,
        bend=0.1136,
        depth=0.012,
        rings=10,
        across=np.cos(turn)[None],
        sunk=-0.4 * np.sin(turn)[None],
    )
    return _turf(base, rng, base.spread(rng, 0.07057, rounds=1), blades)


def lawn(rng: np.random.Generator) -> tuple[Base, Part]:
    """Many bent blades, seen from far: each is folded along its middle, they lean in tufts, some are dry."""
    base = _mound()
    # Two sheets, each from edge to edge over the fold: the lower side and, back again, the upper one.
    blades = Blades(
        length=0.135,
        half_width=(0.005625, 0.00975),
        lean=0.5,
        bend=0.35,
        depth=0.008,
        rings=8,
        across=np.array([[-1.0, 0.0, 1.0], [1.0, 0.0, -1.0]]),
        sunk=np.array([[0.0, 0.75, 0.0], [0.0, 0.55, 0.0]]),
    )
    return _turf(base, rng, base.scatter(rng, 20_000), blades)


@dataclass(frozen=True)
class Blades:
    """How blades of grass are.

    Attributes:
        length: of most.
        half_width: smallest and largest.
        lean: largest angle from upright at the root [rad].
        bend: by how much it grows towards the tip, the scale of a gamma distribution [rad].
        depth: of the root in the soil.
        rings: across a blade, from root to tip.
        across, sunk: (S, K) section as S strips of K points, in half widths; a lone strip is closed.
    """

    length: float
    half_width: tuple[float, float]
    lean: float
    bend: float
    depth: float
    rings: int
    across: np.ndarray
    sunk: np.ndarray


def _turf(base: Base, rng: np.random.Generator, roots: np.ndarray, blades: Blades) -> tuple[Base, Part]:
    """Blades of grass at roots (N, 3) on soil."""
    count, (strips, points) = len(roots), blades.across.shape
    wind = np.arctan2(noise(rng, roots, 0.4), noise(rng, roots, 0.4)) + 1.4 * rng.normal(size=count)
    towards = np.stack([np.cos(wind), np.sin(wind)], axis=1)
    frames = base.frames(roots, interpolate(towards, base.frames(roots)[:, :2]))

    t = np.linspace(0.0, 1.0, blades.rings)
    bend = rng.uniform(0.0, blades.lean, (count, 1)) + rng.gamma(2.2, blades.bend, (count, 1)) * t**1.5
    length = blades.length * np.exp(0.16 * rng.normal(size=count) + 0.12 * noise(rng, roots, 0.3))
    reach, height = _along(np.sin(bend), length), _along(np.cos(bend), length) - blades.depth
    half = rng.uniform(*blades.half_width, (count, 1)) * (1.0 - t**2.5) * (0.7 + 0.6 * np.sqrt(t))
    half, bend, reach, height = (values[:, None, :, None] for values in (half, bend, reach, height))
    across, sunk = half * blades.across[:, None], half * blades.sunk[:, None]
    x, z = reach + sunk * np.cos(bend), height - sunk * np.sin(bend)
    strip = lattice(blades.rings, points, closed=strips == 1)
    lifted = base.lift(roots, frames, np.stack([x, across, z], axis=-1))
    faces = np.concatenate([strip + k * blades.rings * points for k in range(strips)])
    mesh = repeated(lifted.reshape(count, -1, 3), faces)

    up = np.broadcast_to(t[:, None], x.shape).reshape(-1)
    owner = np.repeat(np.arange(count), x[0].size)
    fresh = np.clip(0.5 + 0.24 * rng.normal(size=count) + 0.12 * noise(rng, roots, 0.4), 0.0, 1.0)[owner]
    green = mix(ramp(up, "25390f", "2f5a17", "5d8a2c"), ramp(up, "3c4a12", "69852a", "a5b454"), fresh)
    dry = ramp(up, "5d4f22", "a58f4c", "d2c083")
    colours = mix(green, dry, np.where(rng.random(count) < 0.10, rng.uniform(0.5, 1.0, count), 0.0)[owner])
    colours *= rng.normal(1.0, 0.12, count).clip(0.6, 1.4)[owner, None]
    part = Part(mesh, colours.clip(0.0, 1.0), np.full(len(colours), 0.42))
    return base, joined([part, _ground(base, rng, 0.05, 0.006, "1a1809", "2d2a14", "3d3a1c")])


def _mound() -> Base:
    return Base(lambda d: _lumpy(d, (0.86, 0.80, 0.68), 0.05))


def _along(slope: np.ndarray, length: np.ndarray) -> np.ndarray:
    """Integral of a slope (N, T) over the length (N,) of a blade, (N, T)."""
    steps = 0.5 * (slope[:, 1:] + slope[:, :-1]) * (length[:, None] / (slope.shape[1] - 1))
    return np.concatenate([np.zeros((len(slope), 1)), np.cumsum(steps, axis=1)], axis=1)


def cobbles(rng: np.random.Generator) -> tuple[Base, Part]:
    """Rounded stones of several rocks, set into sandy mortar at various tilts."""
    base = Base(lambda d: _lumpy(d, (0.98, 0.86, 0.80), 0.05))
    spacing, gap, rings, sides = 0.128, 0.0075, 20, 40
    points = base.spread(rng, spacing, rounds=3)
    count = len(points)
    frames = base.frames(points)
    angles = np.linspace(0.0, 2.0 * np.pi, sides, endpoint=False)
    reach = cells(points, frames, angles, 0.13)[:, None] - gap * rng.uniform(0.6, 1.6, (count, 1, 1))
    q = np.sin(np.linspace(0.5 * np.pi, 0.0, rings))[None, :, None]  # 1 at the border, 0 in the middle
    skirt = np.linspace(0.03, 0.0, 4)[None, :, None]  # below the mortar
    radius = reach * np.concatenate([np.ones((1, 4, 1)), q], axis=1)
    rise = spacing * rng.uniform(0.34, 0.52, (count, 1, 1)) * (1.0 - q**3.2) ** (1 / 2.2)
    height = np.concatenate([np.broadcast_to(-skirt, (count, 4, 1)), rise], axis=1) - 0.012
    x, y = radius * np.cos(angles), radius * np.sin(angles)
    tilt = 0.12 * rng.normal(size=(count, 2, 1, 1))
    z = height + tilt[:, 0] * x + tilt[:, 1] * y
    lifted = base.lift(points, frames, np.stack([x, y, z], axis=-1))
    mesh = repeated(lifted.reshape(count, -1, 3), lattice(rings + 4, sides, closed=True))
    bumps = 0.0045 * noise(rng, mesh.vertices, 0.05) + 0.0016 * noise(rng, mesh.vertices, 0.016)
    mesh = mesh.with_vertices(mesh.vertices + bumps[:, None] * mesh.normals)

    stone = np.repeat(np.arange(count), x[0].size)
    mottled = 0.5 + 0.26 * rng.normal(size=count)[stone] + 0.13 * noise(rng, mesh.vertices, 0.03)
    rocks = np.stack([ramp(np.clip(mottled, 0.0, 1.0), *rock) for rock in ROCKS])
    kind = rng.choice(len(ROCKS), count, p=[0.4, 0.22, 0.25, 0.13])
    colours = rocks[kind[stone], np.arange(len(stone))]
    colours *= (1.0 + 0.11 * noise(rng, mesh.vertices, 0.008))[:, None]
    veins = step(0.1, 0.02, np.abs(noise(rng, mesh.vertices, 0.09))) * (rng.random(count) < 0.2)[stone]
    colours = mix(colours, np.array([0.62, 0.60, 0.56]), 0.7 * veins)
    rough = rng.choice([0.32, 0.55, 0.8], count, p=[0.35, 0.4, 0.25])[stone]
    stones = Part(mesh, colours.clip(0.0, 1.0), rough)
    return base, joined([stones, _ground(base, rng, 0.014, 0.0022, "6e6250", "948671", "b5a78e")])


def woven(rng: np.random.Generator) -> tuple[Base, Part]:
    """A closed barrel of rattan: upright strands, and rings that pass over and under them."""
    base = Base(lambda d: _barrel(d, 0.74, 0.92))
    pitch, strands, lift = 0.098, 48, 0.019
    polar = np.linspace(0, np.pi, 2000)
    profile = base.onto(np.stack([np.sin(polar), 0 * polar, np.cos(polar)], axis=1))
    arc = np.concatenate([[0.0], np.cumsum(np.linalg.norm(np.diff(profile, axis=0), axis=1))])
    rows = int(arc[-1] / pitch) - 1
    start = 0.5 * (arc[-1] - (rows - 1) * pitch)

    def at(row: np.ndarray | float, angle: np.ndarray | float) -> np.ndarray:
        radius, z = (np.interp(start + pitch * row, arc, profile[:, c]) for c in (0, 2))
        return np.stack([radius * np.cos(angle), radius * np.sin(angle), z + 0.0 * angle], axis=1)

    # Towards the ends every second strand dives below, so that the others keep their distance.
    width = 2.0 * np.pi * np.interp(start + pitch * np.arange(rows), arc, profile[:, 0]) / strands
    level = np.clip(np.ceil(np.log2(0.62 * pitch / width)), 0, 3).astype(int)
    k = np.arange(strands)
    over = np.where((k[:, None] // 2**level + np.arange(rows)) % 2 == 0, 1.0, -1.0)  # ring over strand
    parts = []
    for row in range(rows):
        used = k[:: 2 ** level[row]]
        turn = np.linspace(0.0, 2.0 * np.pi, 12 * len(used), endpoint=False)
        height = lift * _waves(turn * len(used) / (2.0 * np.pi), np.append(over[used, row], over[0, row]))
        parts.append(_strand(base, rng, at(row, turn), height, 0.46 * pitch, closed=True))
    for strand in k:
        rings = np.flatnonzero(strand % 2**level == 0)
        row = np.linspace(rings[0] - 0.5, rings[-1] + 0.5, 10 * len(rings))
        ends = pitch * np.minimum(row - row[0], row[-1] - row)
        height = -lift * _waves(row, over[strand]) - 0.03 * step(0.05, 0.0, ends) * (strand % 8 != 0)
        foot = at(row, 2.0 * np.pi * strand / strands)
        parts.append(_strand(base, rng, foot, height, 0.40 * pitch, closed=False))
    parts += [_knob(rng, side * profile[0, 2], start + 0.02) for side in (-1.0, 1.0)]
    inner = base.mesh(96)
    inner = inner.with_vertices(inner.vertices - 0.035 * base.normals(inner.vertices))
    dark = np.broadcast_to(ramp(np.zeros(1), "1d120a"), inner.vertices.shape)
    return base, joined([*parts, Part(inner, dark, np.full(len(dark), 0.9))])


def _barrel(directions: np.ndarray, radius: float, half_height: float) -> np.ndarray:
    """Distance from the origin of a barrel around z: bulging sides, rounded rims."""
    side = np.linalg.norm(directions[:, :2], axis=1) / radius
    return (side**3 + np.abs(directions[:, 2] / half_height) ** 3) ** (-1 / 3)


def _knob(rng: np.random.Generator, z: float, radius: float) -> Part:
    """A wooden button that closes an end of the barrel at height z."""
    ball = icosphere(24)
    mesh = Mesh(ball.vertices * (radius, radius, 0.4 * radius) + (0.0, 0.0, z), ball.faces)
    rings = noise(rng, np.linalg.norm(mesh.vertices[:, :2], axis=1, keepdims=True), 0.012)
    colours = ramp(np.clip(0.5 + 0.2 * rings, 0.0, 1.0), "5b3417", "8a5528", "b07a42")
    return Part(mesh, colours, np.full(len(colours), 0.4))


def _waves(at: np.ndarray, values: np.ndarray) -> np.ndarray:
    """Values at 0, 1, 2, ... joined by half cosine waves, constant beyond."""
    at = np.clip(at, 0.0, len(values) - 1.0)
    low = np.minimum(at.astype(int), len(values) - 2)
    share = 0.5 - 0.5 * np.cos(np.pi * (at - low))
    return values[low] + (values[low + 1] - values[low]) * share


def _strand(
    base: Base, rng: np.random.Generator, foot: np.ndarray, height: np.ndarray, half: float, closed: bool
) -> Part:
    """A flat rattan along points of the base, lifted off it; spliced from pieces of several tones."""
    normals = base.normals(foot)
    half = half * rng.uniform(0.9, 1.04)
    vertices, across = ribbon(foot + height[:, None] * normals, normals, half, 0.34 * half, closed)
    count, sides = vertices.shape[:2]
    mesh = repeated(vertices.reshape(1, -1, 3), lattice(count + closed, sides, closed=True) % (count * sides))

    run = np.cumsum(np.linalg.norm(foot - np.roll(foot, 1, axis=0), axis=1))
    piece = np.floor(run / 0.55 + rng.random()).astype(int)
    tone = np.clip(0.5 + 0.23 * rng.normal(size=piece.max() + 1), 0.0, 1.0)[piece].repeat(sides)
    dyed = (rng.random(piece.max() + 1) < 0.16)[piece].repeat(sides)
    at = np.stack([run.repeat(sides) / 12.0, across.reshape(-1)], axis=1)
    fibres = noise(rng, at, 0.006) + 0.6 * noise(rng, mesh.vertices, 0.02)
    tone = np.clip(tone + 0.10 * fibres, 0.0, 1.0)
    colours = np.where(
        dyed[:, None],
        ramp(tone, "3a1a12", "6b2f1e", "8a4a2c"),
        ramp(tone, "7a5024", "b5823f", "dcb673"),
    )
    return Part(mesh, colours, np.clip(0.40 + 0.05 * fibres, 0.25, 0.7))


def _ground(base: Base, rng: np.random.Generator, grain: float, rough: float, *srgb: str) -> Part:
    """The base itself as soil or mortar, uneven by `rough`, coloured by the same noise of size `grain`."""
    mesh = base.mesh(180)
    uneven = noise(rng, mesh.vertices, grain)
    colours = ramp(np.clip(0.5 + 0.25 * uneven + 0.08 * rng.normal(size=len(uneven)), 0.0, 1.0), *srgb)
    moved = mesh.with_vertices(mesh.vertices + rough * uneven[:, None] * mesh.normals)
    return Part(moved, colours, np.full(len(uneven), 0.9))


def _lumpy(directions: np.ndarray, radii: tuple[float, float, float], lumps: float) -> np.ndarray:
    """Distance from the origin of an ellipsoid whose surface waves gently."""
    smooth = 1.0 / np.linalg.norm(directions / np.array(radii), axis=1)
    waves = noise(np.random.default_rng(5), directions, 1.0)
    return smooth * (1.0 + lumps * np.tanh(waves))


KINDS: dict[str, Callable[[np.random.Generator], tuple[Base, Part]]] = {
    "durian": durian,
    "grass": grass,
    "woven": woven,
    "cobbles": cobbles,
    "lawn": lawn,
}
# Grass and lawn share one: the lawn keeps the blades that its measurements are of.
SEEDS = {"durian": 100, "grass": 101, "woven": 102, "cobbles": 103, "lawn": 101}


def main() -> None:
    parser = argparse.ArgumentParser(description=(__doc__ or "").split("\n")[0])
    parser.add_argument("names", nargs="*", metavar="NAME", help=f"{', '.join(KINDS)}; all if none is given")
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument("--views", type=int, default=80)
    parser.add_argument("--resolution", type=int, default=400, help="height and width [pixels]")
    parser.add_argument("--spp", type=int, default=48, help="samples per pixel")
    parser.add_argument("--seed", type=int, default=0)
    options = parser.parse_args()
    if unknown := set(options.names) - set(KINDS):
        parser.error(f"no such capture: {', '.join(sorted(unknown))}")
    for name in options.names or KINDS:
        base, part = KINDS[name](np.random.default_rng([options.seed, SEEDS[name]]))
        write_capture(
            options.out / name,
            part,
            base.mesh(),
            views=options.views,
            resolution=options.resolution,
            spp=options.spp,
            seed=options.seed + SEEDS[name],
        )
        print(f"{options.out / name}: {options.views} views", flush=True)


if __name__ == "__main__":
    main()
