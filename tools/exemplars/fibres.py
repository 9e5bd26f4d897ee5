"""Fibres: wicker, knitwear."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from exemplar_kit import FINE, Material, blur, colour, grid, mix, noise, ramp, sample, step


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


def knit(rng: np.random.Generator) -> Material:
    """Heathered blue wool in stockinette: rows of V-shaped stitches of plied yarn, with stray fibres."""
    yarn = _yarn(rng, 11, 15)
    cover = yarn.radius > 0.0
    angle = np.arcsin(np.clip(yarn.across, -1.0, 1.0))
    ply = 3.0 * angle / (2.0 * np.pi) + yarn.along / 0.040
    bulge = np.abs(np.cos(np.pi * ply))
    # The fibres run along the plies, which climb around the yarn.
    lie = yarn.along + 0.012 * yarn.across
    turned = yarn.across * 0.014 - 0.10 * yarn.along
    fibres = sample(noise(rng, 0.05, 0.6, 40.0), lie, turned)
    fine = sample(noise(rng, 0.016, 0.2, 25.0), lie, turned)
    grain = noise(rng, 0.006, 0.3)
    height = np.where(cover, yarn.height, -0.030)
    height += np.where(cover, 0.0034 * bulge + 0.0004 * fibres + 0.0002 * fine, 0.0) + 0.0001 * grain
    fuzz, fuzz_tone = _fuzz(rng, 420)
    soft = blur(height, 0.003)
    height = height + (np.maximum(soft + 0.004, height) - height) * 0.7 * fuzz

    shade = 0.50 + 0.10 * fibres + 0.06 * fine + 0.05 * noise(rng, 0.25, 1.3) + 0.16 * (bulge - 0.6)
    shade = np.clip(shade - 0.32 * np.abs(yarn.across) ** 3, 0.0, 1.0)
    blue = ramp(shade, "0c1726", "1d3350", "345578", "587fa0", "93b2c4")
    slate = ramp(shade, "161b26", "333c50", "586378", "8a95a3", "c3c9cc")
    albedo = mix(blue, slate, step(0.2, 1.6, sample(noise(rng, 0.08, 0.9, 20.0), lie, turned)))
    albedo = mix(albedo, colour("cfd8da")[0], 0.22 * step(1.6, 2.6, fine))
    depth = step(-0.005, 0.029, height)
    albedo = albedo * (0.16 + 0.94 * depth)[..., None]
    albedo = mix(albedo, ramp(fuzz_tone, "3c5f82", "7d9fb8", "cdd9dd"), 0.45 * fuzz)
    return Material(height, albedo, np.clip(0.86 + 0.02 * fine + 0.01 * grain, 0.5, 1.0))


@dataclass
class _Yarn:
    """What is seen of a yarn, (N, N) each."""

    height: np.ndarray  # [texture widths]
    along: np.ndarray  # arc length [texture widths]
    across: np.ndarray  # from -1 to 1, from border to border
    radius: np.ndarray  # [texture widths], 0 where no yarn is


def _yarn(rng, columns, rows) -> _Yarn:
    """Stockinette: rows of (t + a sin 2t, h cos t, -d cos 2t), drawn disc by disc into a depth buffer."""
    layers = _Yarn(*(np.full((FINE, FINE), value) for value in (-9.0, 0.0, 0.0, 0.0)))
    per_stitch = 110
    t = np.arange(columns * per_stitch) * (2.0 * np.pi / per_stitch)
    unit = 1.0 / (2.0 * np.pi * columns)
    for row in range(rows):
        sway = [_loop_noise(rng, len(t)) for _ in range(4)]
        px = (t + 1.45 * np.sin(2.0 * t)) * unit + 0.0022 * sway[0] + 0.0012 * rng.standard_normal()
        py = (row + 0.5) / rows - 4.1 * unit * np.cos(t) * (1.0 + 0.03 * sway[1]) + 0.0016 * sway[2]
        pz = -0.9 * unit * np.cos(2.0 * t)
        radius = 1.30 * unit * (1.0 + 0.05 * sway[3])
        tangent = np.stack([np.gradient(px), np.gradient(py)], axis=1)
        speed = np.linalg.norm(tangent, axis=1)
        along = np.cumsum(np.hypot(speed, np.gradient(pz))) + rng.random()
        for k in range(len(t)):
            _disc(layers, (px[k], py[k], pz[k]), tangent[k] / speed[k], along[k], radius[k])
    return layers


def _loop_noise(rng, count: int) -> np.ndarray:
    """Smooth noise of unit variance around a loop of `count` samples, a few waves to a stitch."""
    f = np.fft.rfftfreq(count, 1.0 / count)
    spectrum = np.fft.rfft(rng.standard_normal(count)) * np.exp(-((f / 14.0) ** 2)) * (f > 0)
    values = np.fft.irfft(spectrum, count)
    return values / values.std()


def _disc(layers: _Yarn, centre, direction, along: float, radius: float) -> None:
    """Draw a short piece of yarn where nothing higher lies."""
    reach = int(radius * FINE) + 1
    column, row = int(centre[0] * FINE), int(centre[1] * FINE)
    offsets = np.arange(-reach, reach + 1)
    dx = (column + 0.5 + offsets[None, :]) / FINE - centre[0]
    dy = (row + 0.5 + offsets[:, None]) / FINE - centre[1]
    d2 = dx**2 + dy**2
    z = centre[2] + 0.75 * np.sqrt(np.maximum(radius**2 - d2, 0.0))
    window = np.ix_((row + offsets) % FINE, (column + offsets) % FINE)
    seen = (d2 < radius**2) & (z > layers.height[window])
    across = (direction[0] * dy - direction[1] * dx) / radius
    for layer, value in (
        (layers.height, z),
        (layers.along, along + direction[0] * dx + direction[1] * dy),
        (layers.across, across),
        (layers.radius, radius),
    ):
        layer[window] = np.where(seen, value, layer[window])


def _fuzz(rng, count: int) -> tuple[np.ndarray, np.ndarray]:
    """Stray fibres: how much they cover, and their tone, both in [0, 1]."""
    cover, tone = np.zeros((FINE, FINE)), np.zeros((FINE, FINE))
    length = 60
    heading = rng.uniform(0.0, 2.0 * np.pi, (count, 1)) + np.cumsum(rng.normal(0.0, 0.10, (count, length)), 1)
    heading += np.cumsum(np.broadcast_to(rng.normal(0.0, 0.03, (count, 1)), (count, length)), 1)
    px = rng.random((count, 1)) * FINE + np.cumsum(np.cos(heading), 1)
    py = rng.random((count, 1)) * FINE + np.cumsum(np.sin(heading), 1)
    place = (py.astype(int) % FINE, px.astype(int) % FINE)
    cover[place] = np.sin(np.linspace(0.0, np.pi, length)) ** 0.5
    tone[place] = rng.random((count, 1))
    cover = blur(cover, 0.0005)
    return np.clip(cover / 0.55, 0.0, 1.0), blur(tone, 0.0005) / np.maximum(cover, 1e-3)
