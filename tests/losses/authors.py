"""The comparison of colours as MeshNCA's authors do it, in plain NumPy and float64."""

import numpy as np

MEAN = np.array([0.485, 0.456, 0.406])
SPREAD = np.array([0.229, 0.224, 0.225])
DECORRELATION = np.array(
    [[0.57735, 0.57735, 0.57735], [-0.57735, 0.78868, -0.21132], [-0.57735, -0.21132, 0.78868]]
)


def colour_cost(a: np.ndarray, b: np.ndarray) -> float:
    """Equation 4 between two sets of sRGB values (n, 3) and (m, 3) in [0, 1]."""
    x, y = (((c.astype(np.float64) - MEAN) / SPREAD) @ DECORRELATION for c in (a, b))
    lengths = np.outer(np.linalg.norm(x, axis=1), np.linalg.norm(y, axis=1))
    squares = ((x[:, None] - y[None]) ** 2).sum(2)
    costs = 1 - x @ y.T / lengths + np.clip(squares, 1e-5, 1e5) / 3
    return max(costs.min(1).mean(), costs.min(0).mean())
