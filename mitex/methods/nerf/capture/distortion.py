"""Lens distortion of OpenCV's model with two radial and two tangential terms, and its inverse."""

from __future__ import annotations

import numpy as np

ITERATIONS = 100  # at most
CONVERGED = 1e-10  # change of an iteration that is the last


def distort(points: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """Where an ideal image point lands behind the lens.

    Args:
        points: (..., 2) x / z and y / z in the camera's space, y down.
        coefficients: (..., 4) k1, k2, p1, p2.

    Returns:
        (..., 2) float64.
    """
    points, coefficients = np.asarray(points, np.float64), np.asarray(coefficients, np.float64)
    if not coefficients.any():
        return points
    radial, tangential = _terms(points, coefficients)
    return points * radial + tangential


def undistort(points: np.ndarray, coefficients: np.ndarray) -> np.ndarray:
    """The inverse of `distort` by fixed-point iteration; not meaningful where the lens folds the image.

    Args:
        points: (..., 2) places behind the lens, in the units of `distort`.
        coefficients: as of `distort`.

    Returns:
        Ideal points, of the same shape, float64.
    """
    points, coefficients = np.asarray(points, np.float64), np.asarray(coefficients, np.float64)
    if not coefficients.any():
        return points
    ideal = points
    for _ in range(ITERATIONS):
        radial, tangential = _terms(ideal, coefficients)
        last, ideal = ideal, (points - tangential) / np.maximum(radial, 0.1)
        if np.abs(ideal - last).max(initial=0.0) < CONVERGED:
            break
    return ideal


def folds(points: np.ndarray, coefficients: np.ndarray) -> bool:
    """Whether `undistort` fails for some of the distorted points (..., 2): the lens folds the image there."""
    with np.errstate(all="ignore"):
        again = distort(undistort(points, coefficients), coefficients)
        return not np.abs(again - points).max(initial=0.0) <= 1e-6  # NaN counts as folded


def _terms(points: np.ndarray, coefficients: np.ndarray) -> tuple[np.ndarray, np.ndarray]:
    """The radial factor (..., 1) and the tangential shift (..., 2)."""
    k1, k2, p1, p2 = (coefficients[..., k] for k in range(4))
    x, y = points[..., 0], points[..., 1]
    square = x * x + y * y
    radial = 1.0 + square * (k1 + square * k2)
    shift_x = 2.0 * p1 * x * y + p2 * (square + 2.0 * x * x)
    shift_y = p1 * (square + 2.0 * y * y) + 2.0 * p2 * x * y
    return radial[..., None], np.stack([shift_x, shift_y], axis=-1)
