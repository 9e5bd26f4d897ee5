"""Wood: boards."""

from __future__ import annotations

import numpy as np
from exemplar_kit import Material, colour, grid, mix, noise, ramp, sample, step


def planks(rng: np.random.Generator) -> Material:
    """Weathered boards with rings, knots, cracks and rusty nails."""
    x, y = grid()
    rows = 5
    row = np.floor(y * rows).astype(int)
    v = (y * rows - row - 0.5) / rows
    start, length = rng.random(rows)[row], rng.uniform(0.38, 0.62, rows)[row]
    along = (x - start) % 1.0
    board = 2 * row + (along > length)
    end = np.minimum(np.minimum(along, np.abs(along - length)), 1.0 - along)
    knot, around = _knots(rng, x, y, row, rows, 7)
    late, rho = _rings(rng, x, y, v, board, 2 * rows, around)

    fibres, fine = noise(rng, 0.06, 0.8, 70.0), noise(rng, 0.02, 0.3, 50.0)
    grain = noise(rng, 0.006, 0.3)
    lift, slope, tone, hue = rng.normal(0.0, 1.0, (4, 2 * rows))[:, board]
    wobble = 0.0009 * noise(rng, 0.08, 1.2, 4.0) + 0.0006 * fibres
    edge = np.minimum(0.5 / rows - np.abs(v), end) - 0.0018 + wobble
    board_edge = step(0.0, 0.0025, edge)
    rounded = np.sqrt(1.0 - (1.0 - np.clip(edge / 0.007, 0.0, 1.0)) ** 2)
    checks = step(1.9, 2.7, noise(rng, 0.09, 1.0, 90.0) + 1.1 * step(0.09, 0.0, end) - 0.3)
    nail = np.hypot(end - 0.020, np.abs(v) - 0.052 + 0.003 * slope)
    head = step(0.0068, 0.0056, nail)
    height = rounded * (0.016 + 0.0016 * lift + 0.020 * slope * v - 0.30 * v**2)
    height += board_edge * (0.0011 * late + 0.0007 * fibres + 0.0004 * fine + 0.0008 * knot) - 0.006 * checks
    height += 0.0012 * noise(rng, 0.15, 1.8, 5.0) * board_edge
    height = height + (0.0145 + 0.0016 * lift + 0.0002 * grain - height) * head

    shade = 0.60 + 0.09 * tone + 0.08 * fibres + 0.06 * fine + 0.03 * grain - 0.30 * late
    shade = np.clip(shade + 0.07 * noise(rng, 0.2, 1.3, 6.0), 0.0, 1.0)
    brown = ramp(shade, "2f2117", "5c412b", "8c6845", "b08c62", "cdb188")
    honey = ramp(shade, "3a2213", "744a28", "a57240", "c79a62", "e0c08d")
    grey = ramp(shade, "2e2b27", "5a554d", "87806f", "aaa393", "c9c3b4")
    albedo = mix(brown, honey, step(-0.2, 1.4, hue))
    albedo = mix(albedo, grey, 0.80 * step(-0.6, 1.6, noise(rng, 0.25, 1.1, 4.0) - 0.5 * hue))
    pores = step(1.7, 2.6, noise(rng, 0.010, 0.6, 25.0))
    albedo = mix(albedo, colour("2a1c12")[0], 0.45 * pores)
    heart = ramp(np.clip(0.5 + 0.5 * np.cos(900.0 * rho) + 0.2 * grain, 0, 1), "24140b", "3d2413", "5c381f")
    albedo = mix(albedo, heart, 0.85 * knot)
    stain = np.exp(-(((nail - 0.006) / 0.010) ** 2)) * step(-1.0, 1.4, fibres)
    albedo = mix(albedo, colour("2b221d")[0], 0.55 * stain)
    rust = ramp(np.clip(0.5 + 0.22 * grain, 0, 1), "20140f", "4a2a1a", "7a4a2c")
    albedo = mix(mix(albedo, colour("140d08")[0], 0.9 * checks), rust, head)
    albedo = mix(colour("0d0906")[0], albedo, step(-0.001, 0.0035, edge))
    rough = 0.74 + 0.05 * fine + 0.08 * checks - 0.10 * knot - 0.06 * late
    return Material(height, albedo, np.clip(rough - 0.15 * head, 0.3, 1.0))


def _knots(rng, x, y, row, rows, count) -> tuple[np.ndarray, np.ndarray]:
    """Branches cut across: their hearts in [0, 1]; how far the rings give way to them [texture widths]."""
    heart, around = np.zeros(x.shape), np.zeros(x.shape)
    wx, wy = x + 0.002 * noise(rng, 0.04, 1.4), y + 0.002 * noise(rng, 0.04, 1.4)
    for place in rng.permutation(2 * rows)[:count] // 2:
        cx, cy = rng.random(), (place + rng.uniform(0.25, 0.75)) / rows
        size = rng.uniform(0.009, 0.017)
        d = np.hypot(((wx - cx + 0.5) % 1.0 - 0.5) / 1.5, (wy - cy + 0.5) % 1.0 - 0.5) / size
        inside = row == place
        heart = np.where(inside, np.maximum(heart, step(1.15, 0.9, d)), heart)
        around = around + np.where(inside, 2.6 * size * np.exp(-((d / 2.6) ** 2)), 0.0)
    return heart, around


def _rings(rng, x, y, v, board, boards, around) -> tuple[np.ndarray, np.ndarray]:
    """Late wood in [0, 1], and the distance to the pith [texture widths]; every board is another cut."""
    pith, depth = rng.normal(0.0, 0.05, boards)[board], rng.uniform(0.01, 0.09, boards)[board]
    px, py = x + rng.random(boards)[board], y + rng.random(boards)[board]
    bend = sample(noise(rng, 0.5, 2.4, 2.0), px, py)
    ripple = sample(noise(rng, 0.10, 1.6, 12.0), px, py)
    rho = np.hypot(v - pith, depth + 0.045 * bend) + 0.0022 * ripple + around
    phase = (rho * rng.uniform(80.0, 150.0, boards)[board]) % 1.0
    return phase**2.5 * step(1.0, 0.86, phase), rho
