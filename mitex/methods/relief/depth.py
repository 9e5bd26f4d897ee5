"""How deep the relief of an exemplar is: what its height map leaves open, its normals say."""

from __future__ import annotations

import numpy as np
from scipy.ndimage import uniform_filter

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.geometry.normal_maps import of_slopes, slopes

FLATTEST = 1e-4  # depth of a relief [widths of the exemplar]
AROUND = 3  # pixels that slopes are averaged over: maps of 8 bits are rough


def with_depth(exemplar: Exemplar, depth: float = 0.0) -> tuple[Exemplar, float]:
    """The exemplar with the height map and the normals of one relief, and how deep that is.

    A height map has no unit. Where there are normals as well, that depth is taken whose slopes come nearest
    to theirs, by least squares; normals alone are integrated.

    Args:
        exemplar: with a height map, normals, or both.
        depth: from 0 to 1 of the height map [widths of the exemplar's central square]; 0 asks the normals.

    Returns:
        The exemplar, and the depth.

    Raises:
        ConfigError: there is neither map; the depth is neither given nor said by normals; the relief is flat,
            as that of a height map of one grey.
    """
    maps = dict(exemplar.maps)
    if "height" not in maps and "normal" not in maps:
        raise ConfigError(
            f"exemplar {exemplar.name} has no height map and no normals", "give a folder with one of them"
        )
    if "normal" not in maps and not depth:
        raise ConfigError(
            f"exemplar {exemplar.name} has no normals, which would say how deep its height map is",
            "set the depth, such as depth=0.05",
        )
    if "height" not in maps:
        heights = _integrated(slopes(maps["normal"])) / min(exemplar.size)
        low, high = float(heights.min()), float(heights.max())
        _check_depth(high - low, exemplar.name)
        maps["height"] = ((heights - low) / (high - low)).astype(np.float32)[..., None]
        told = high - low
    else:
        told = depth or _told(maps["height"][..., 0], slopes(maps["normal"]))
        _check_depth(told * float(np.ptp(maps["height"])), exemplar.name)
    if depth:
        maps["normal"] = of_slopes(depth * _rises(maps["height"][..., 0]))
    return Exemplar(dict(sorted(maps.items())), exemplar.name), depth or told


def _told(height: np.ndarray, told: np.ndarray) -> float:
    """The factor of heights (H, W) whose slopes are nearest to those told (H, W, 2)."""
    own, told = _smooth(_rises(height)), _smooth(told)
    return float((own * told).sum() / max(float((own * own).sum()), 1e-30))


def _rises(height: np.ndarray) -> np.ndarray:
    """How much heights (H, W) rise to the right and upwards (H, W, 2) [widths of the central square]."""
    down, right = np.gradient(height.astype(np.float64))
    return min(height.shape) * np.stack([right, -down], axis=-1)


def _integrated(rises: np.ndarray) -> np.ndarray:
    """Heights (H, W) [px] whose slopes are nearest to (H, W, 2) by least squares.

    As Frankot and Chellappa do (1988), with the differences between pixels for derivatives. The picture is
    continued by its mirror image, so that it needs not repeat.
    """
    right, down = rises[..., 0], -rises[..., 1]
    right = np.concatenate([right, -right[:, ::-1]], axis=1)
    right = np.concatenate([right, right[::-1]], axis=0)
    down = np.concatenate([down, down[:, ::-1]], axis=1)
    down = np.concatenate([down, -down[::-1]], axis=0)
    total, squares = np.zeros(right.shape, complex), np.zeros(right.shape)
    for axis, values in ((1, right), (0, down)):
        between = 0.5 * (values + np.roll(values, -1, axis))
        frequency = np.expand_dims(np.fft.fftfreq(values.shape[axis]), 1 - axis)
        difference = np.exp(2j * np.pi * frequency) - 1
        total += difference.conj() * np.fft.fft2(between)
        squares += np.abs(difference) ** 2
    squares[0, 0] = 1.0  # the mean is free
    return np.fft.ifft2(total / squares).real[: len(rises), : rises.shape[1]]


def _smooth(values: np.ndarray) -> np.ndarray:
    return np.stack([uniform_filter(values[..., k], AROUND) for k in range(2)], axis=-1)


def _check_depth(depth: float, name: str) -> None:
    if not depth > FLATTEST:
        raise ConfigError(
            f"the relief of exemplar {name} is {depth:.2g} of its width deep",
            "set the depth, such as depth=0.05; a height map must not be of one grey",
        )
