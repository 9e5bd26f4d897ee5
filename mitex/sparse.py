"""Sparse matrices for torch."""

from __future__ import annotations

import warnings
from typing import Any

import numpy as np
import torch


def csr_tensor(matrix: Any, device: torch.device | str = "cpu") -> torch.Tensor:
    """A scipy CSR array or matrix (N, M) as a sparse float32 tensor with 32-bit indices.

    Torch's own conversion gives 64-bit indices, with which products take twice the time. (`Any`, because type
    checkers take the `shape` of a scipy array for None.)
    """
    indptr, indices, data = (
        torch.from_numpy(values.astype(dtype)).to(device)
        for values, dtype in (
            (matrix.indptr, np.int32),
            (matrix.indices, np.int32),
            (matrix.data, np.float32),
        )
    )
    return csr(indptr, indices, data, matrix.shape)


def csr(
    indptr: torch.Tensor, indices: torch.Tensor, values: torch.Tensor, shape: tuple[int, int]
) -> torch.Tensor:
    """The sparse (N, M) tensor of CSR's three arrays, which it shares; they are not checked.

    Args:
        indptr: (N + 1,) int32, where each row starts in the other two.
        indices: (E,) int32, the column of each entry.
        values: (E,) float32.
        shape: (N, M).
    """
    with warnings.catch_warnings():
        warnings.filterwarnings("ignore", message="Sparse CSR tensor support is in beta")
        return torch.sparse_csr_tensor(indptr, indices, values, size=shape, check_invariants=False)
