"""Laid in rows: bricks, hexagons, scales."""

from __future__ import annotations

import numpy as np
from exemplar_kit import Material, cells, colour, grid, mix, noise, ramp, relaxed_points, sample, step


def bricks(rng: np.random.Generator) -> Material:
    """Old red bricks in running bond: chipped edges, sandy mortar, lime and soot."""
    x, y = grid()
    columns, rows = 3, 8
    count = columns * rows
    wx, wy = x + 0.0022 * noise(rng, 0.10, 1.6), y + 0.0022 * noise(rng, 0.10, 1.6)
    row = np.floor(wy * rows)
    shift = 0.5 * (row % 2)
    column = np.floor(wx * columns - shift)
    brick = ((row % rows) * columns + column % columns).astype(int)
    u = (wx * columns - shift - column - 0.5) / columns
    v = (wy * rows - row - 0.5) / rows
    turn, right, down, long, high, lift, tip = rng.normal(0.0, 1.0, (7, count))[:, brick]
    u, v = u + 0.010 * turn * v - 0.0016 * right, v - 0.010 * turn * u - 0.0010 * down
    radius = 0.008
    qx = np.abs(u) - 0.5 / columns + 0.0075 - 0.0012 * long + radius
    qy = np.abs(v) - 0.5 / rows + 0.0070 - 0.0008 * high + radius
    edge = radius - np.hypot(np.maximum(qx, 0), np.maximum(qy, 0)) - np.minimum(np.maximum(qx, qy), 0)

    lumps, grain, sand = noise(rng, 0.035, 0.9), noise(rng, 0.008, 0.4), noise(rng, 0.005, 0.1)
    chips = step(0.9, 2.3, noise(rng, 0.045, 0.9))
    edge = edge - 0.0075 * chips * step(0.024, 0.004, edge) + 0.0011 * lumps + 0.0005 * grain
    bevel = np.sqrt(1.0 - (1.0 - np.clip(edge / 0.010, 0.0, 1.0)) ** 2)
    pits = step(1.5, 2.4, noise(rng, 0.012, 1.0))
    folds = noise(rng, 0.05, 0.8, 5.0)  # the clay was dragged along its mould
    face = 0.015 + 0.0014 * lift + 0.010 * tip * v + 0.0009 * folds + 0.0006 * lumps + 0.0002 * grain
    face = bevel * (face - 0.0022 * pits) + 0.0001 * sand
    joint = 0.0055 + 0.0011 * noise(rng, 0.04, 1.0) + 0.0005 * grain + 0.0003 * sand
    height = np.maximum(face, joint)
    is_brick = step(-0.0004, 0.0008, face - joint)

    tone, burnt, hue = rng.random((3, count))[:, brick]
    tone = 0.22 + 0.52 * tone + 0.08 * noise(rng, 0.09, 1.0) + 0.05 * folds + 0.05 * grain
    clay = mix(
        ramp(np.clip(tone, 0, 1), "4b1d15", "74301f", "94452c", "b0603e", "c98c66"),
        ramp(np.clip(tone, 0, 1), "54291c", "87472b", "a9633d", "c08254", "d6ab80"),
        step(0.45, 1.0, hue),
    )
    ends = step(0.02, 0.13, np.abs(u) + 0.02 * noise(rng, 0.08, 1.1))
    kiln = step(0.62, 0.95, burnt) * (0.35 + 0.65 * ends) + 0.25 * step(0.3, 2.0, noise(rng, 0.12, 1.0))
    clay = mix(clay, ramp(np.clip(tone, 0, 1), "211816", "3d2a27", "5a403a"), np.clip(kiln, 0, 0.85))
    clay = clay * (1.0 + 0.08 * grain + 0.05 * sand)[..., None]
    clay = mix(clay, colour("2a1612")[0], 0.65 * pits + 0.35 * step(1.6, 2.8, sand))
    clay = mix(clay, colour("d9a583")[0], 0.35 * step(1.7, 2.8, -sand) + 0.30 * chips * step(0.02, 0.0, edge))
    lime = step(0.5, 2.2, noise(rng, 0.16, 0.9) + 0.35 * lumps + 0.7 * step(0.016, 0.002, edge))
    clay = mix(clay, colour("c9bfb2")[0], 0.50 * lime * step(-1.6, 1.2, grain))
    pale = np.clip(0.5 + 0.13 * noise(rng, 0.1, 0.8) + 0.12 * sand, 0.0, 1.0)
    mortar = ramp(pale, "6f675d", "a39a8b", "cfc6b5")
    mortar = mix(mortar, colour("3c352e")[0], 0.5 * step(1.5, 2.6, grain) + 0.4 * step(0.0035, 0.0, edge))
    soot = step(0.5, 2.4, noise(rng, 0.30, 1.0))
    albedo = mix(mortar, clay, is_brick) * (1.0 - 0.35 * soot)[..., None]
    rough = 0.86 + 0.02 * grain - 0.12 * is_brick * step(0.4, 1.0, kiln) + 0.05 * lime
    return Material(height, albedo, np.clip(rough, 0.4, 1.0))


def hexagons(rng: np.random.Generator) -> Material:
    """A floor of honed marble hexagons, white and grey, with dark grout."""
    x, y = grid()
    columns, rows = 7, 8  # 7 * 2 / sqrt(3) is 8.08: almost regular
    count = columns * rows
    tile, u, v, border = _nearest_hexagon(x, y, columns, rows)
    right, down, lift, tip, lean = rng.normal(0.0, 1.0, (5, count))[:, tile]
    border = border + 0.0006 * (right * u + down * v) * columns * 2 + 0.0003 * noise(rng, 0.02, 1.0)
    grain, dust = noise(rng, 0.010, 0.6), noise(rng, 0.004, 0.2)
    chips = step(1.5, 2.6, noise(rng, 0.030, 1.0)) * step(0.012, 0.0, border)
    edge = border - 0.0048 - 0.0045 * chips
    bevel = np.sqrt(1.0 - (1.0 - np.clip(edge / 0.0045, 0.0, 1.0)) ** 2)
    grout = 0.0035 + 0.0005 * noise(rng, 0.03, 0.9) + 0.0003 * grain + 0.0002 * dust
    stone = bevel * (0.0085 + 0.0005 * lift + 0.006 * (tip * u + lean * v)) + 0.00010 * noise(rng, 0.05, 1.2)
    pits = step(2.3, 3.0, noise(rng, 0.008, 0.7))
    stone = stone - 0.0010 * pits
    height = np.maximum(stone, grout)
    is_stone = step(0.0, 0.0006, stone - grout)

    # Every tile is cut from another place of one slab, turned as it came.
    angle = np.pi / 3.0 * np.floor(6.0 * rng.random(count))[tile]
    px = np.cos(angle) * u - np.sin(angle) * v + rng.random(count)[tile]
    py = np.sin(angle) * u + np.cos(angle) * v + rng.random(count)[tile]
    cloud, vein, thin = (sample(field, px, py) for field in _marble(rng))
    grey = step(0.85, 0.87, rng.random(count))[tile]
    tone = 0.68 + 0.11 * cloud + 0.05 * lift - 0.42 * vein - 0.25 * thin + 0.02 * grain + 0.02 * dust
    white = ramp(np.clip(tone, 0, 1), "6d7178", "9a9da1", "c6c5c3", "e4e1dc", "f3f0ea")
    tone = 0.40 + 0.13 * cloud + 0.55 * vein + 0.5 * thin + 0.03 * grain + 0.03 * dust
    dark = ramp(np.clip(tone, 0, 1), "26292e", "3f444b", "5f656c", "8f9498", "c9cbca")
    marble = mix(white, dark, grey)
    veined = np.clip(vein + thin, 0.0, 1.0)
    warm = step(0.6, 2.2, sample(noise(rng, 0.12, 1.2), px, py)) * (1.0 - grey)
    marble = mix(marble, marble * colour("f3dfc0")[0], warm * (0.25 + 0.50 * veined))
    marble = mix(marble, colour("5a5149")[0], 0.6 * pits + 0.35 * chips)
    marble = marble * (0.80 + 0.20 * step(0.0, 0.004, edge))[..., None]
    cement = ramp(np.clip(0.45 + 0.12 * grain + 0.12 * dust, 0, 1), "2e2a27", "4b4540", "6d655d")
    worn = step(0.3, 2.0, noise(rng, 0.25, 1.0))
    rough = 0.20 + 0.10 * worn + 0.02 * grain + 0.06 * veined + 0.25 * pits
    rough = rough + (0.85 - rough) * (1.0 - is_stone)
    return Material(height, mix(cement, marble, is_stone), np.clip(rough, 0.05, 1.0))


def _nearest_hexagon(x, y, columns, rows) -> tuple[np.ndarray, np.ndarray, np.ndarray, np.ndarray]:
    """The hexagon of every sample: index, offset (u, v) from its centre, distance to its border."""
    u, v, tile = np.full(x.shape, 9.0), np.full(x.shape, 9.0), np.zeros(x.shape, int)
    aspect = columns * 2.0 / np.sqrt(3.0) / rows
    for parity in (0, 1):
        row = 2.0 * np.floor((y * rows - parity + 1.0) / 2.0) + parity
        column = np.floor(x * columns - 0.5 * parity + 0.5)
        du = x - (column + 0.5 * parity) / columns
        dv = (y - row / rows) / aspect
        nearer = np.hypot(du, dv) < np.hypot(u, v)
        u, v = np.where(nearer, du, u), np.where(nearer, dv, v)
        tile = np.where(nearer, (row % rows) * columns + column % columns, tile).astype(int)
    across = np.maximum(np.abs(u), 0.5 * np.abs(u) + np.sqrt(0.75) * np.abs(v))
    return tile, u, v, 0.5 / columns - across


def _marble(rng) -> tuple[np.ndarray, np.ndarray, np.ndarray]:
    """Clouds of unit variance, broad veins and thin veins in [0, 1], of a slab of marble."""
    cloud = noise(rng, 0.22, 1.3)
    place = noise(rng, 0.30, 1.6, 2.0)
    vein = np.exp(-np.abs(place + 0.10 * noise(rng, 0.05, 1.0)) / 0.16) * step(-1.2, 1.0, cloud)
    crossing = noise(rng, 0.16, 1.5, 3.0)
    thin = np.exp(-np.abs(crossing + 0.08 * noise(rng, 0.03, 0.9)) / 0.05)
    thin = thin * step(-0.4, 1.4, noise(rng, 0.2, 1.4))
    return cloud, vein, thin


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
