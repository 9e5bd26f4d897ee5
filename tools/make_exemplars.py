"""Makes the exemplars that ship with Mitex: procedural, tileable PBR sets, deterministic, ours (CC0).

    python tools/make_exemplars.py [--out DIR] [--sheet SHEET.png] [NAME ...]

Every material is one function that returns height and colours on a periodic grid of `FINE` x `FINE` samples;
normals and ambient occlusion follow from the height, and everything is averaged down to `SIZE` x `SIZE`.
"""

from __future__ import annotations

import argparse
from collections.abc import Callable
from pathlib import Path

import numpy as np
from exemplar_kit import (
    SIZE,
    Material,
    blur,
    cells,
    colour,
    grid,
    lit,
    maps,
    mix,
    noise,
    ramp,
    relaxed_points,
    step,
)
from PIL import Image

OUT = Path(__file__).parent.parent / "mitex" / "data" / "exemplars"
LICENSE = """CC0 1.0 Universal (public domain dedication)
https://creativecommons.org/publicdomain/zero/1.0/

The exemplars in this folder are procedural. They were made for Mitex by tools/make_exemplars.py; to the
extent possible under law, the Mitex authors have waived all copyright and related rights to them.
"""


def cobblestone(rng: np.random.Generator) -> Material:
    """Worn granite cobbles, rounded, with moss and wet earth between them."""
    x, y = grid()
    count = 28
    points = relaxed_points(rng, count, 5)
    warp = 0.012
    wx, wy = x + warp * noise(rng, 0.12, 2.0), y + warp * noise(rng, 0.12, 2.0)
    stone, border = cells(points, wx, wy, 0.012)
    border = border + 0.0012 * noise(rng, 0.03, 1.6)
    inside = np.clip((border - 0.010) / 0.055, 0.0, 1.0)
    dome = np.sqrt(1.0 - (1.0 - inside) ** 2.6)
    is_stone = step(0.006, 0.016, border)

    lift = rng.normal(0.0, 0.007, count)[stone]
    chips, grain = noise(rng, 0.08, 1.0), noise(rng, 0.012, 0.6)
    pits = step(1.2, 2.2, noise(rng, 0.02, 1.2))
    top = dome * (0.050 + lift) + dome * (0.0028 * chips + 0.0004 * grain) - 0.0016 * pits * dome
    earth = 0.006 + 0.0022 * noise(rng, 0.03, 0.8) + 0.0012 * grain

    damp = noise(rng, 0.45, 1.8)
    tufts = noise(rng, 0.018, 0.9)
    moss = step(-0.35, 0.55, 0.9 * damp + 0.35 * tufts + 2.4 * (0.5 - border / 0.030)) * step(
        0.042, 0.012, border
    )
    moss_height = 0.013 + 0.0035 * noise(rng, 0.05, 1.5) + 0.0026 * tufts
    height = np.maximum(top * is_stone, earth)
    height = np.where(moss_height * moss > height * moss, height + (moss_height - height) * moss, height)
    height += 0.0012 * tufts * moss

    tone = rng.random(count)[stone]
    warm = rng.random(count)[stone]
    mottled = np.clip(tone + 0.13 * noise(rng, 0.06, 1.0) + 0.06 * grain, 0.0, 1.0)
    rock = mix(
        ramp(mottled, "4a4d52", "6c6f72", "8d8c88", "aeaaa2"),
        ramp(mottled, "4c4038", "77675a", "96836f", "b8a88f"),
        step(0.35, 0.9, warm),
    )
    speckle = noise(rng, 0.006, 0.2)
    rock = rock * (1.0 + 0.10 * grain + 0.09 * speckle)[..., None]
    rock = mix(rock, colour("2c2b2a")[0], 0.55 * step(1.5, 2.6, speckle) + 0.5 * pits)
    rock = mix(rock, colour("d3cfc6")[0], 0.45 * step(1.7, 2.8, -speckle))
    worn = step(0.2, 1.4, chips) * step(0.5, 1.0, dome)
    rock = mix(rock, rock * 1.25 + 0.02, 0.6 * worn)
    rock = rock * (0.42 + 0.58 * step(0.0, 0.55, inside))[..., None]  # dirt gathers at the rim
    soil = ramp(np.clip(0.5 + 0.25 * noise(rng, 0.02, 0.7), 0, 1), "1f1812", "332a20", "4a3e30")
    green = ramp(np.clip(0.45 + 0.22 * tufts + 0.12 * damp, 0, 1), "1c2a0d", "3a4f16", "5f7526", "8a9a3f")
    albedo = mix(mix(soil, rock, is_stone), green * (1.0 + 0.12 * speckle)[..., None], moss)
    rough = 0.62 + 0.05 * chips + 0.05 * grain - 0.10 * worn + 0.12 * pits
    rough = np.where(is_stone > 0.5, rough, 0.82 + 0.04 * grain)
    return Material(height, albedo, np.clip(rough + (0.95 - rough) * moss, 0.3, 1.0))


def scales(rng: np.random.Generator) -> Material:
    """Glazed ceramic roof scales, jade to deep teal, with gold rims."""
    x, y = grid()
    columns, rows = 5, 6
    radius = 0.5 / columns * 1.13
    pitch = 1.0 / rows
    best_row = np.full(x.shape, np.inf)
    owner = np.zeros(x.shape, int)
    rim = np.zeros(x.shape)
    along = np.zeros(x.shape)
    across = np.zeros(x.shape)
    for row in range(-2, rows + 2):
        for column in range(-1, columns + 1):
            cx = (column + 0.5 * (row % 2)) / columns
            dx = (x - cx + 0.5) % 1.0 - 0.5
            dy = y - row * pitch
            # A rounded shingle: a half disc hangs from a slightly widening body.
            d = np.hypot(dx, np.maximum(dy, 0.0) * (radius / (pitch * 0.98)) * 0.92)
            covers = (d < radius) & (dy > -pitch * 1.2) & (row < best_row)
            best_row[covers] = row
            owner[covers] = (row % rows) * columns + column % columns
            rim[covers] = (radius - d)[covers]
            along[covers] = (dy / pitch)[covers]
            across[covers] = (dx / radius)[covers]
    return _scale_material(rng, owner, rim / radius, along, across, columns * rows)


def _scale_material(rng, owner, rim, along, across, count) -> Material:
    lift = rng.normal(0.0, 1.0, (4, count))[:, owner]
    bevel = np.sqrt(np.clip(1.0 - (1.0 - np.clip(rim / 0.30, 0, 1)) ** 2, 0, 1))
    crown = 1.0 - across**2
    ripple = noise(rng, 0.07, 2.0)
    height = 0.022 * along + 0.016 * bevel + 0.012 * crown + 0.0012 * lift[0] + 0.0007 * ripple
    gold = step(0.125, 0.095, rim + 0.010 * noise(rng, 0.05, 1.5))
    ridge = np.exp(-(((rim - 0.06) / 0.05) ** 2))
    height += gold * (0.006 * ridge + 0.0004 * noise(rng, 0.01, 0.5))

    pool = np.exp(-np.clip(rim - 0.12, 0, None) / 0.10) + 0.55 * step(0.35, -0.5, along)
    tone = 0.62 - 0.42 * pool + 0.13 * lift[1] + 0.07 * ripple + 0.05 * noise(rng, 0.03, 0.8)
    glaze = mix(
        ramp(np.clip(tone, 0, 1), "04262e", "0b4f55", "1f8a80", "6fc3a8", "c8e9cf"),
        ramp(np.clip(tone, 0, 1), "06203c", "0d4270", "1f77a0", "6db8c8", "cfeaea"),
        step(0.2, 1.4, lift[2]),
    )
    crack_cells = relaxed_points(rng, 1500, 2)
    x, y = grid()
    _, crack = cells(
        crack_cells, x + 0.004 * noise(rng, 0.05, 1.5), y + 0.004 * noise(rng, 0.05, 1.5), 0.0008
    )
    crackle = step(0.0016, 0.0004, crack) * step(-0.3, 0.8, noise(rng, 0.2, 1.5))
    glaze = mix(glaze, glaze * 0.45, 0.8 * crackle)
    bubbles = step(2.3, 3.0, noise(rng, 0.008, 0.8))
    glaze = mix(glaze, colour("e8f3e4")[0], 0.5 * bubbles)
    shine = np.clip(0.55 + 0.2 * noise(rng, 0.04, 1.0) + 0.1 * noise(rng, 0.008, 0.3), 0, 1)
    metal = ramp(shine, "7a4f12", "b98226", "e3b64f", "f7dd8e")
    rough = 0.14 + 0.02 * ripple + 0.25 * crackle + 0.05 * np.abs(lift[3])
    albedo = mix(glaze, metal, gold)
    return Material(height, albedo, np.clip(rough + (0.34 + 0.05 * ripple - rough) * gold, 0.05, 1.0))


def wicker(rng: np.random.Generator) -> Material:
    """A basket of split rattan: thin weavers run over and under broad stakes."""
    x, y = grid()
    stakes, weavers = 6, 12
    sway = 0.0035 * noise(rng, 0.25, 2.0)
    stake_height, stake_id, stake_u = _strands(rng, y + 0.0, x + sway, stakes, weavers, 0.62, 0)
    weave_height, weave_id, weave_u = _strands(rng, x, y + 0.6 * sway.T, weavers, stakes, 0.96, 1)
    stake_height = 0.026 * stake_height
    weave_height = 0.022 * weave_height
    on_top = weave_height > stake_height
    height = np.maximum(np.maximum(stake_height, weave_height), -0.044)

    fibres = np.where(on_top, noise(rng, 0.05, 0.7, 60.0), noise(rng, 0.05, 0.7, 60.0).T)
    fine = np.where(on_top, noise(rng, 0.02, 0.2, 40.0), noise(rng, 0.02, 0.2, 40.0).T)
    height = height + 0.0007 * fibres + 0.0004 * fine
    strand = np.where(on_top, weave_id, stake_id + weavers)
    tint = rng.normal(0.0, 1.0, (2, stakes + weavers))
    tone = 0.52 + 0.10 * tint[0][strand] + 0.10 * fibres + 0.07 * fine + 0.10 * noise(rng, 0.3, 1.5)
    cane = ramp(np.clip(tone, 0, 1), "4a2a10", "8a5a26", "bd8b48", "dcb878", "f0dcae")
    reddish = ramp(np.clip(tone, 0, 1), "3d1d0c", "74401c", "a86a36", "cc9a62", "e8cfa0")
    albedo = mix(cane, reddish, step(0.3, 1.3, tint[1][strand]))
    across = np.where(on_top, weave_u, stake_u)
    albedo = albedo * (1.0 - 0.35 * np.abs(across) ** 4)[..., None]
    marks = step(1.9, 2.6, noise(rng, 0.02, 0.9)) * 0.5 + step(2.0, 2.8, fine) * 0.5
    albedo = mix(albedo, colour("3a2210")[0], marks)
    gap = step(-0.016, -0.042, height)
    albedo = mix(albedo, colour("120a05")[0], 0.92 * gap)
    return Material(height, albedo, np.clip(0.50 - 0.06 * fibres - 0.04 * fine + 0.3 * gap, 0.2, 1.0))


def _strands(rng, u, v, count, crossings, fill, phase) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Strands along u, `count` of them side by side in v: height, strand index, position across [-1, 1]."""
    index = np.floor(v * count).astype(int) % count
    width = fill * (1.0 + rng.normal(0.0, 0.03, count))[index]
    across = (((v * count) % 1.0) - 0.5) * 2.0 / width
    body = np.sqrt(np.clip(1.0 - across**2, 0.0, 1.0))
    wave = np.cos(np.pi * (u * crossings - 0.5 + index + phase))
    wave = np.sign(wave) * np.abs(wave) ** 0.75
    height = np.where(np.abs(across) < 1.0, 0.95 * wave + 1.1 * body - 0.7, -9.0)
    return height, index, np.clip(across, -1.0, 1.0)


def lava(rng: np.random.Generator) -> Material:
    """Cooling lava: dark broken crust over glowing melt."""
    x, y = grid()
    wx, wy = x + 0.016 * noise(rng, 0.12, 1.9), y + 0.016 * noise(rng, 0.12, 1.9)
    plates = relaxed_points(rng, 20, 2)
    plate, border = cells(plates, wx, wy, 0.004)
    shards = relaxed_points(rng, 130, 1)
    shard, small = cells(shards, wx + 0.006 * noise(rng, 0.04, 1.2), wy, 0.002)
    rough_noise, grain = noise(rng, 0.10, 1.4), noise(rng, 0.012, 0.5)
    width = np.clip(0.013 + 0.006 * noise(rng, 0.25, 1.5), 0.004, 0.03)
    crack = step(1.0, 0.0, border / width)
    hairline = step(0.005, 0.0, small) * step(-0.2, 0.9, noise(rng, 0.2, 1.3))
    slab = step(0.0, 0.055, border)
    lift = rng.normal(0.0, 1.0, len(plates))[plate]
    tilt = rng.normal(0.0, 1.0, len(shards))[shard]
    height = slab * (0.036 + 0.007 * lift) + slab * (0.004 * tilt + 0.0042 * rough_noise + 0.0004 * grain)
    height = height - 0.010 * hairline * slab
    heat = np.clip(crack + 0.42 * hairline * step(0.10, 0.02, border), 0.0, 1.0)
    heat = np.clip(heat * (0.95 + 0.16 * noise(rng, 0.06, 1.2)), 0.0, 1.0)

    tone = np.clip(0.42 + 0.11 * tilt + 0.12 * rough_noise + 0.10 * grain, 0, 1)
    crust = ramp(tone, "0d0c0d", "1d1b1c", "322e2d", "564f4b", "7d746d")
    ash = step(0.8, 2.0, noise(rng, 0.05, 0.9)) * slab
    crust = mix(crust, colour("6f6660")[0], 0.5 * ash)
    rust = step(0.5, 1.8, noise(rng, 0.15, 1.1))
    crust = mix(crust, colour("4a2416")[0], 0.45 * rust)
    glow = blur(heat, 0.012)
    crust = crust + glow[..., None] * colour("c8320a")[0] * 0.55
    melt = ramp(heat, "3a0603", "a01c05", "e8510c", "fb9a1e", "ffe07a")
    albedo = mix(crust, melt, step(0.12, 0.45, heat))
    rough = 0.80 + 0.06 * grain - 0.10 * step(0.2, 1.5, rough_noise) - 0.35 * heat
    return Material(height, albedo, np.clip(rough, 0.1, 1.0))


MATERIALS: dict[str, tuple[Callable[[np.random.Generator], Material], int]] = {
    "cobblestone": (cobblestone, 11),
    "lava": (lava, 12),
    "scales": (scales, 13),
    "wicker": (wicker, 14),
}


def make(name: str) -> dict[str, np.ndarray]:
    """The maps of one exemplar, name -> (SIZE, SIZE, 1 or 3) uint8."""
    function, seed = MATERIALS[name]
    return maps(function(np.random.default_rng(seed)))


def main() -> None:
    parser = argparse.ArgumentParser(description="Makes the exemplars that ship with Mitex.")
    parser.add_argument(
        "names", nargs="*", metavar="NAME", help=f"of {', '.join(MATERIALS)}; all when none is given"
    )
    parser.add_argument("--out", type=Path, default=OUT)
    parser.add_argument(
        "--sheet", type=Path, help="also write all maps and a lit preview side by side, for judging"
    )
    options = parser.parse_args()
    rows = []
    for name in options.names or MATERIALS:
        result = make(name)
        (options.out / name).mkdir(parents=True, exist_ok=True)
        for key, array in result.items():
            Image.fromarray(array.squeeze()).save(options.out / name / f"{key}.png", optimize=True)
        tiles = [np.broadcast_to(a, (SIZE, SIZE, 3)) for a in result.values()]
        columns = [np.concatenate([np.concatenate([t, t], 0) for t in tiles], 1), lit(result)]
        rows.append(np.concatenate(columns, 1))
    (options.out / "LICENSE").write_text(LICENSE)
    if options.sheet:
        Image.fromarray(np.concatenate(rows, 0)).save(options.sheet)


if __name__ == "__main__":
    main()
