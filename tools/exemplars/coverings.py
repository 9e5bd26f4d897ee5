"""Coverings: leather, and paint that gives way to rust."""

from __future__ import annotations

import numpy as np
from exemplar_kit import FINE, Material, cells, colour, grid, mix, noise, ramp, relaxed_points, step


def leather(rng: np.random.Generator) -> Material:
    """Full-grain cowhide, cognac: pebbles and wrinkles, pores, creases, worn where it stands out."""
    x, y = grid()
    wx = x + 0.008 * noise(rng, 0.30, 2.0) + 0.0016 * noise(rng, 0.03, 1.2)
    wy = y + 0.008 * noise(rng, 0.30, 2.0) + 0.0016 * noise(rng, 0.03, 1.2)
    pebbles = relaxed_points(rng, 1300, 1)
    pebble, border = cells(pebbles, wx, wy, 0.0011)
    _, wrinkle = cells(relaxed_points(rng, 7000, 0), wx, wy, 0.0004)
    hold = step(-1.3, 0.6, noise(rng, 0.10, 1.1))  # where the furrows are deep
    broad = np.clip(0.0042 + 0.0012 * noise(rng, 0.06, 1.0), 0.002, 0.008)
    dome = 1.0 - (1.0 - np.clip(border / broad, 0.0, 1.0)) ** 2
    small = 1.0 - (1.0 - np.clip(wrinkle / 0.0022, 0.0, 1.0)) ** 2
    swell, grain, fine = noise(rng, 0.30, 2.0), noise(rng, 0.010, 0.8), noise(rng, 0.004, 0.3)
    lift, tone = rng.normal(0.0, 1.0, (2, len(pebbles)))[:, pebble]
    creases = _creases(rng)
    pores = step(1.9, 2.7, noise(rng, 0.008, 1.6))
    depth = 0.0016 + 0.0030 * hold
    height = depth * dome + 0.0008 * lift * dome + 0.0006 * small * dome + 0.0001 * grain
    height += 0.0012 * swell - 0.0055 * creases - 0.0016 * pores * dome

    proud = dome * (0.65 + 0.35 * small) * (1.0 - creases)
    shade = 0.40 + 0.30 * (proud - 0.5) + 0.04 * tone + 0.035 * noise(rng, 0.15, 1.1)
    shade = np.clip(shade + 0.03 * grain + 0.02 * fine, 0.0, 1.0)
    tan = ramp(shade, "1d0c06", "4c220e", "7e401a", "a8612c", "cf9254")
    red = ramp(shade, "1c0a07", "491a10", "76321b", "a0522f", "c98a5f")
    albedo = mix(tan, red, 0.5 * step(-1.0, 2.0, noise(rng, 0.28, 1.5)))
    worn = step(0.4, 2.2, noise(rng, 0.20, 1.1) + 0.5 * swell) * step(0.5, 1.0, proud)
    albedo = mix(albedo, ramp(shade, "6a3a1c", "b57a45", "dcae7b"), 0.32 * worn)
    dark = np.clip(0.55 * pores + 0.35 * creases + 0.45 * (1.0 - dome) * hold, 0.0, 0.85)
    albedo = mix(albedo, colour("160905")[0], dark)
    scuffs = step(2.0, 2.9, noise(rng, 0.05, 0.7, 60.0)) * step(0.5, 1.6, noise(rng, 0.12, 1.2))
    albedo = mix(albedo, colour("d0a070")[0], 0.45 * scuffs * proud)
    rough = 0.58 - 0.14 * proud - 0.08 * worn + 0.01 * grain + 0.10 * pores + 0.12 * scuffs
    return Material(height, albedo, np.clip(rough, 0.2, 1.0))


def _creases(rng) -> np.ndarray:
    """Folds in the hide, in [0, 1]: level lines of smooth noise, which fade in and out."""
    total = np.zeros((FINE, FINE))
    for scale, stretch, width in ((0.30, 3.0, 0.045), (0.30, 0.5, 0.04), (0.15, 1.5, 0.05)):
        level = noise(rng, scale, 2.0, stretch) + 0.05 * noise(rng, 0.03, 1.0)
        fade = step(0.2, 1.5, noise(rng, 0.20, 1.5))
        total = np.maximum(total, fade * np.exp(-(np.abs(level / width) ** 1.5)))
    return total


def rust(rng: np.random.Generator) -> Material:
    """Sheet steel under faded green paint that blisters, flakes and lets rust through and run down."""
    spread, ragged = noise(rng, 0.30, 1.25), noise(rng, 0.03, 0.9)
    grain, fine = noise(rng, 0.010, 0.5), noise(rng, 0.004, 0.2)
    attack = spread + 0.22 * ragged + 0.05 * grain
    attack = attack + 0.9 * step(1.9, 3.0, noise(rng, 0.030, 1.2)) * step(-0.9, 0.6, spread)
    bare = step(0.55, 0.60, attack)  # no paint
    primer = step(0.44, 0.47, attack + 0.10 * noise(rng, 0.05, 1.2)) * (1.0 - bare)
    paint = 1.0 - np.maximum(bare, primer)
    near = step(-0.5, 0.45, attack)

    x, y = grid()
    flakes = relaxed_points(rng, 420, 1)
    flake, seam = cells(flakes, x + 0.004 * ragged, y + 0.006 * noise(rng, 0.05, 1.2), 0.001)
    lift = rng.normal(0.0, 1.0, len(flakes))[flake]
    scab = noise(rng, 0.06, 0.9)
    pits = step(1.1, 2.2, noise(rng, 0.014, 1.0))
    iron = 0.0018 * scab + 0.0009 * lift * step(0.0, 0.004, seam) - 0.0020 * pits
    iron = iron + 0.0006 * grain + 0.0003 * fine
    curl = np.exp(-(((attack - 0.40) / 0.09) ** 2)) * step(-1.2, 1.0, noise(rng, 0.05, 1.2))
    blisters = step(1.1, 2.2, noise(rng, 0.022, 1.8)) * near
    brush = noise(rng, 0.05, 0.7, 40.0)
    coat = 0.0040 + 0.0035 * curl + 0.0022 * blisters + 0.00012 * brush + 0.0003 * noise(rng, 0.03, 1.6)
    height = iron * (bare + 0.15 * primer) + coat * paint + 0.0020 * primer + 0.0012 * noise(rng, 0.4, 2.0)

    tone = np.clip(0.46 + 0.15 * scab + 0.06 * lift + 0.13 * grain + 0.07 * fine, 0.0, 1.0)
    oxide = mix(
        ramp(tone, "1f100b", "45200f", "77361a", "a85624", "d28a48"),
        ramp(tone, "150e0d", "2e1a15", "4d2a1e", "6e402b", "8f5d42"),
        step(-0.4, 1.3, noise(rng, 0.10, 1.0) + 0.8 * (spread - 1.4)),
    )
    oxide = mix(oxide, colour("120a08")[0], 0.6 * pits)
    run = _runs(rng, bare)
    fade = np.clip(0.5 + 0.14 * noise(rng, 0.3, 1.1) + 0.05 * brush + 0.04 * grain + 0.03 * fine, 0, 1)
    green = ramp(fade, "3f6258", "648a7c", "8eb0a0", "b9cfc0")
    chalk = step(0.5, 2.2, noise(rng, 0.12, 0.9))
    green = mix(green, colour("d3ddd0")[0], 0.30 * chalk)
    stained = green * ramp(np.clip(run + 0.25 * near**2, 0, 1), "ffffff", "e2b07a", "a85f2c", "7a3c17")
    dirt = step(0.8, 2.4, noise(rng, 0.03, 0.7))
    stained = mix(stained, colour("3b372d")[0], 0.35 * dirt)
    undercoat = ramp(np.clip(0.5 + 0.2 * grain + 0.2 * ragged, 0, 1), "6a3a2c", "8f5a46", "b08a74")
    albedo = oxide * bare[..., None] + undercoat * primer[..., None] + stained * paint[..., None]
    painted = 0.36 + 0.10 * chalk + 0.25 * np.clip(run, 0.0, 1.0) + 0.12 * dirt
    rough = 0.88 * bare + 0.72 * primer + painted * paint
    return Material(height, albedo, np.clip(rough + 0.03 * grain, 0.1, 1.0))


def _runs(rng, source: np.ndarray) -> np.ndarray:
    """Where water carried rust down from `source`; streaks, [0, 1] and a little more."""
    decay = np.exp(-np.arange(FINE) / (0.10 * FINE))
    kernel = np.fft.fft(decay / decay.sum())[:, None]
    streaks = step(-0.3, 2.0, noise(rng, 0.14, 0.8, 60.0).T)
    carried = np.fft.ifft(np.fft.fft(source * streaks, axis=0) * kernel, axis=0).real
    return 2.6 * carried * (0.4 + 0.6 * streaks)
