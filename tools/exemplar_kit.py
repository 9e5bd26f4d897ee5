"""Periodic building blocks for procedural materials, and the maps that follow from a height field."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from scipy import ndimage, spatial

from mitex.geometry.vectors import unit

SIZE = 512
FINE = 1024
STRIP = 32  # rows that are worked on at once, which stay in the cache


@dataclass
class Material:
    """What a material function returns, on the fine grid; row 0 is the top."""

    height: np.ndarray  # (N, N), [texture widths]
    albedo: np.ndarray  # (N, N, 3), linear [0, 1]
    roughness: np.ndarray  # (N, N), [0, 1]


# ---- periodic building blocks: everything below wraps around both borders ----


def grid() -> tuple[np.ndarray, np.ndarray]:
    """Sample positions x (to the right) and y (down), each (N, N) in [0, 1)."""
    axis = (np.arange(FINE) + 0.5) / FINE
    return np.meshgrid(axis, axis)


def noise(rng: np.random.Generator, scale: float, roughness: float = 1.0, stretch: float = 1.0) -> np.ndarray:
    """Periodic Gaussian noise of unit variance.

    Args:
        scale: size of the largest features [texture widths].
        roughness: exponent of the spectrum's fall above that size; 0 is white, 1 fractal, 2 smooth.
        stretch: features are this much longer in x than in y.
    """
    fx = np.fft.rfftfreq(FINE, 1 / FINE)[None, :] * np.sqrt(stretch)
    fy = np.fft.fftfreq(FINE, 1 / FINE)[:, None] / np.sqrt(stretch)
    f = np.hypot(fx, fy) * scale
    spectrum = np.fft.rfft2(rng.standard_normal((FINE, FINE)))
    spectrum *= (1.0 + f**2) ** (-0.5 * (1.0 + roughness)) * (f > 0)
    field = np.fft.irfft2(spectrum, (FINE, FINE))
    return field / field.std()


def blur(field: np.ndarray, sigma: float) -> np.ndarray:
    """Periodic Gaussian blur, sigma in texture widths."""
    along, down = (
        np.exp(-2.0 * (np.pi * sigma * frequencies(FINE, 1 / FINE)) ** 2)
        for frequencies in (np.fft.rfftfreq, np.fft.fftfreq)
    )
    spectrum = np.fft.rfft2(field)
    return np.fft.irfft2(spectrum * along[None, :] * down[:, None], (FINE, FINE))


def sample(field: np.ndarray, x: np.ndarray, y: np.ndarray) -> np.ndarray:
    """The periodic field at any positions, interpolated linearly."""
    return ndimage.map_coordinates(field, [y * FINE - 0.5, x * FINE - 0.5], order=1, mode="grid-wrap")


def step(low: float, high: float, x: np.ndarray) -> np.ndarray:
    """Smooth step from 0 at `low` to 1 at `high` (which may be the smaller one)."""
    t = np.clip((x - low) / (high - low), 0.0, 1.0)
    return t * t * (3.0 - 2.0 * t)


def mix(a: np.ndarray, b: np.ndarray, t: np.ndarray) -> np.ndarray:
    """Blend colours (..., 3) by weights (...)."""
    return a + (b - a) * np.asarray(t)[..., None]


def colour(*srgb: str) -> np.ndarray:
    """Hexadecimal sRGB colours as linear values, (len, 3)."""
    values = np.array([[int(c[i : i + 2], 16) for i in (0, 2, 4)] for c in srgb]) / 255.0
    return np.where(values <= 0.04045, values / 12.92, ((values + 0.055) / 1.055) ** 2.4)


def ramp(t: np.ndarray, *srgb: str) -> np.ndarray:
    """Colour ramp through evenly spaced hexadecimal sRGB colours; t in [0, 1]."""
    stops = colour(*srgb)
    knots = np.linspace(0.0, 1.0, len(stops))
    return np.stack([np.interp(t, knots, stops[:, c]) for c in range(3)], axis=-1)


def relaxed_points(rng: np.random.Generator, count: int, rounds: int) -> np.ndarray:
    """`count` points on the unit torus, spread evenly by `rounds` of Lloyd's iteration; (count, 2)."""
    points = rng.random((count, 2))
    samples = rng.random((count * 400, 2))
    for _ in range(rounds):
        owner = np.asarray(spatial.KDTree(points, boxsize=1.0).query(samples, workers=-1)[1])
        offset = (samples - points[owner] + 0.5) % 1.0 - 0.5
        total = np.stack([np.bincount(owner, offset[:, k], count) for k in range(2)], axis=1)
        points = (points + total / np.maximum(np.bincount(owner, minlength=count), 1)[:, None]) % 1.0
    return points


def cells(points: np.ndarray, x: np.ndarray, y: np.ndarray, softness: float) -> tuple[np.ndarray, np.ndarray]:
    """Voronoi cells on the torus: the owner of every sample, and its distance to the cell's border.

    The distance is a soft minimum over the bisectors to the next neighbours, which rounds the corners.
    """
    here = np.stack([x, y], axis=-1).reshape(-1, 2) % 1.0
    distance, index = map(np.asarray, spatial.KDTree(points, boxsize=1.0).query(here, k=8, workers=-1))
    owner = index[:, 0]
    gaps = []
    for k in range(1, 8):
        between = (points[index[:, k]] - points[owner] + 0.5) % 1.0 - 0.5
        gaps.append((distance[:, k] ** 2 - distance[:, 0] ** 2) / (2.0 * np.linalg.norm(between, axis=1)))
    gap = np.stack(gaps)
    border = -softness * np.log(np.exp(-gap / softness).sum(axis=0))
    return owner.reshape(x.shape), np.maximum(border, 0.0).reshape(x.shape)


# ---- maps that follow from the height ----


def normals(height: np.ndarray) -> np.ndarray:
    """Tangent-space normals (N, N, 3), +x right, +y up, of a periodic height in texture widths."""
    dx = (np.roll(height, -1, 1) - np.roll(height, 1, 1)) * (FINE / 2)
    dy = (np.roll(height, 1, 0) - np.roll(height, -1, 0)) * (FINE / 2)
    return unit(np.stack([-dx, -dy, np.ones_like(height)], axis=-1))


def ambient_occlusion(height: np.ndarray, reach: float = 0.12, directions: int = 16) -> np.ndarray:
    """Cosine-weighted sky visibility in [0, 1], from the horizon within `reach` texture widths."""
    steps = np.unique(np.geomspace(1, reach * FINE, 14).round())
    margin = int(steps[-1])
    around = np.pad(height, margin, mode="wrap")
    strips = [
        _visibility(around[top : top + STRIP + 2 * margin], margin, steps, directions)
        for top in range(0, len(height), STRIP)
    ]
    return np.concatenate(strips)


def _visibility(around: np.ndarray, margin: int, steps: np.ndarray, directions: int) -> np.ndarray:
    """`ambient_occlusion` of a strip of heights, given with a margin around it."""
    rows, columns = (side - 2 * margin for side in around.shape)
    here = around[margin : margin + rows, margin : margin + columns]
    total, rise = np.zeros_like(here), np.empty_like(here)
    for angle in np.arange(directions) * (2.0 * np.pi / directions):
        slope = np.zeros_like(here)
        for s in steps:
            j, i = round(s * np.cos(angle)), round(s * np.sin(angle))
            run = np.hypot(i, j) / FINE
            fade = 1.0 - (s / steps[-1]) ** 2  # far walls count less, so that no ring shows at the reach
            there = around[margin + i : margin + i + rows, margin + j : margin + j + columns]
            np.subtract(there, here, out=rise)
            rise *= fade
            rise /= run
            np.maximum(slope, rise, out=slope)
        total += slope**2 / (1.0 + slope**2)
    return 1.0 - total / directions


def downsample(field: np.ndarray) -> np.ndarray:
    """Box average from FINE to SIZE."""
    k = FINE // SIZE
    return field.reshape(SIZE, k, SIZE, k, -1).mean(axis=(1, 3))


def maps(material: Material) -> dict[str, np.ndarray]:
    """The five 8-bit maps of a material; the height is stretched to the full range."""
    height = material.height
    normal = unit(downsample(normals(height)))
    albedo = np.clip(downsample(material.albedo), 0.0, 1.0)
    albedo = np.where(albedo <= 0.0031308, albedo * 12.92, 1.055 * albedo ** (1 / 2.4) - 0.055)
    low, high = np.percentile(height, [0.1, 99.9])
    result = {
        "albedo": albedo,
        "ambient_occlusion": downsample(ambient_occlusion(height)),
        "height": downsample((height - low) / (high - low)),
        "normal": normal * 0.5 + 0.5,
        "roughness": downsample(material.roughness),
    }
    return {k: np.round(np.clip(v, 0.0, 1.0) * 255.0).astype(np.uint8) for k, v in result.items()}


def lit(result: dict[str, np.ndarray]) -> np.ndarray:
    """A quick lit preview (2 x 2 tiles), to judge how the maps work together; (2 N, 2 N, 3) uint8."""
    m = {k: np.tile(v, (2, 2, 1)) / 255.0 for k, v in result.items()}
    n = m["normal"] * 2.0 - 1.0
    light = np.array([-0.5, 0.6, 0.62]) / np.linalg.norm([-0.5, 0.6, 0.62])
    half = light + [0.0, 0.0, 1.0]
    half /= np.linalg.norm(half)
    albedo = np.where(m["albedo"] <= 0.04045, m["albedo"] / 12.92, ((m["albedo"] + 0.055) / 1.055) ** 2.4)
    diffuse = np.clip(n @ light, 0, 1)[..., None]
    a2 = np.maximum(m["roughness"], 0.08) ** 4
    nh = np.clip(n @ half, 0, 1)[..., None]
    glossy = 0.04 * a2 / (np.pi * (nh**2 * (a2 - 1.0) + 1.0) ** 2) * diffuse
    linear = albedo * (0.35 * m["ambient_occlusion"] + 0.95 * diffuse) + np.minimum(glossy, 3.0)
    return np.round(np.clip(linear, 0, 1) ** (1 / 2.2) * 255.0).astype(np.uint8)
