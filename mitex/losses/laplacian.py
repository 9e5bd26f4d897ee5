"""Keeps values on a mesh from changing wildly from vertex to vertex."""

from __future__ import annotations

import torch


def laplacian_excess(
    values: torch.Tensor, rows: torch.Tensor, neighbours: torch.Tensor, tolerance: float
) -> torch.Tensor:
    """`max(0, mean_i |sum_j (v_j - v_i)| - tolerance)`, j the neighbours of i (MeshNCA, equations 16 and 17).

    The paper prints the sum without its absolute value. As each edge counts once with either sign, the mean
    of those is zero for any values, and would constrain nothing.

    Args:
        values: (V,).
        rows, neighbours: (E,) int64, i and j of each directed edge (`mitex.mesh.topology.EdgeGraph`).
        tolerance: xi.
    """
    differences = values[neighbours] - values[rows]
    sums = torch.zeros_like(values).index_add(0, rows, differences)
    return (sums.abs().mean() - tolerance).clamp(min=0)
