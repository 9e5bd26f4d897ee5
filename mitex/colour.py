"""sRGB to linear and back: the one place in Mitex where the two meet.

Exemplars, synthesized albedo, features and losses live in sRGB; the path tracer takes linear values.
"""

from __future__ import annotations

from typing import Any, TypeVar

import numpy as np

Array = TypeVar("Array")

LUMINANCE = np.array([0.299, 0.587, 0.114], np.float32)
"""Weights of sRGB values in a grey picture (ITU-R BT.601)."""


def srgb_to_linear(x: Array) -> Array:
    """Decode sRGB values with the curve of IEC 61966-2-1.

    Args:
        x: numpy array or torch tensor of any shape, sRGB, nominally in [0, 1]. Values outside are carried
            through the linear piece (below 0) or the power (above 1), so that nothing becomes NaN.

    Returns:
        Linear values, same type and shape; differentiable when `x` is a torch tensor.
    """
    linear_piece = x / 12.92  # type: ignore[operator]
    power_piece = ((_at_least(x, 0.04045) + 0.055) / 1.055) ** 2.4
    return _where(x <= 0.04045, linear_piece, power_piece)  # type: ignore[operator]


def linear_to_srgb(x: Array) -> Array:
    """Encode linear values in sRGB, the inverse of `srgb_to_linear`, with the same treatment of outliers."""
    linear_piece = x * 12.92  # type: ignore[operator]
    power_piece = 1.055 * _at_least(x, 0.0031308) ** (1.0 / 2.4) - 0.055
    return _where(x <= 0.0031308, linear_piece, power_piece)  # type: ignore[operator]


def _is_tensor(x: Any) -> bool:
    # Told by its method: importing torch here would cost every command a second.
    return hasattr(x, "clamp")


def _at_least(x: Any, low: float) -> Any:
    # The unused branch of a `where` must stay finite, or its gradient poisons the used one.
    return x.clamp(min=low) if _is_tensor(x) else np.maximum(x, low)


def _where(condition: Any, a: Any, b: Any) -> Any:
    return a.where(condition, b) if _is_tensor(a) else np.where(condition, a, b)
