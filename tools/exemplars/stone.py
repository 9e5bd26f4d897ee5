"""Stones: cobbles, lava."""

from __future__ import annotations

import numpy as np
from exemplar_kit import Material, blur, cells, colour, grid, mix, noise, ramp, relaxed_points, step


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
