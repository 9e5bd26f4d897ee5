"""Sparse matrices for torch: fixed ones with their transpose, and lookups that differ from step to step."""

from __future__ import annotations

import warnings
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np
import torch
from torch.autograd.function import once_differentiable

# Torch warns once a process that these tensors are new. It does so here, rather than at some call, since the
# filters of warnings are those of all threads.
with warnings.catch_warnings():
    warnings.simplefilter("ignore")
    torch.sparse_csr_tensor(torch.tensor([0, 0]), torch.tensor([]), torch.tensor([]), (1, 1))


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
    return torch.sparse_csr_tensor(indptr, indices, values, size=shape, check_invariants=False)


def transposed_product(
    indptr: torch.Tensor, indices: torch.Tensor, values: torch.Tensor, columns: int, rows: torch.Tensor
) -> torch.Tensor:
    """The transpose of a matrix (N, columns), given by CSR's three arrays, times rows (N, C), on the CPU.

    scipy adds each row's entries to their columns; torch would sort the matrix first.
    """
    import scipy.sparse

    data = (values.numpy(), indices.numpy(), indptr.numpy())
    matrix = scipy.sparse.csr_array(data, shape=(len(indptr) - 1, columns))
    return torch.from_numpy(np.ascontiguousarray(matrix.T @ rows.contiguous().numpy()))


class LinearMap:
    """A constant sparse matrix, differentiable in what it is applied to.

    Args:
        matrix: (M, N), from scipy.
        device: where it is applied.
    """

    def __init__(self, matrix: Any, device: torch.device | str = "cpu") -> None:
        self.matrix = csr_tensor(matrix.tocsr(), device)
        self.adjoint = csr_tensor(matrix.T.tocsr(), device)

    def __call__(self, rows: torch.Tensor) -> torch.Tensor:
        """(N, C) -> (M, C)."""
        return _Product.apply(rows, self.matrix, self.adjoint)


@dataclass(frozen=True, eq=False)
class Weights:
    """Weighted sums of a table's rows.

    Attributes:
        index: (P, K) int32, rows of the table.
        weight: (P, K) float32.
        columns: number of rows of the table.
    """

    index: torch.Tensor
    weight: torch.Tensor
    columns: int

    def to(self, device: torch.device | str) -> Weights:
        """The same on another device."""
        return replace(self, index=self.index.to(device), weight=self.weight.to(device))

    @cached_property
    def matrix(self) -> torch.Tensor:
        """(P, columns) sparse CSR."""
        points, count = self.index.shape
        indptr = torch.arange(0, points * count + 1, count, dtype=torch.int32, device=self.index.device)
        return csr(indptr, self.index.reshape(-1), self.weight.reshape(-1), (points, self.columns))

    def __call__(self, table: torch.Tensor) -> torch.Tensor:
        """(columns, C) -> (P, C), differentiable in the table."""
        return _Lookup.apply(table, self)

    def transposed(self, gradient: torch.Tensor) -> torch.Tensor:
        """(P, C) -> (columns, C), the adjoint of `__call__`."""
        if gradient.device.type != "cpu":
            out = gradient.new_zeros(self.columns, gradient.shape[1])
            for k in range(self.index.shape[1]):
                out.index_add_(0, self.index[:, k], self.weight[:, k, None] * gradient)
            return out
        points, count = self.index.shape
        indptr = torch.arange(0, points * count + 1, count, dtype=torch.int32)
        return transposed_product(
            indptr, self.index.reshape(-1), self.weight.reshape(-1), self.columns, gradient
        )


class _Product(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, rows: torch.Tensor, matrix: torch.Tensor, adjoint: torch.Tensor) -> torch.Tensor:
        ctx.adjoint = adjoint
        with torch.autocast(rows.device.type, enabled=False):  # which knows no sparse matrices
            return matrix @ rows.contiguous()

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: torch.Tensor) -> tuple[torch.Tensor, None, None]:
        return ctx.adjoint @ gradient.contiguous(), None, None


class _Lookup(torch.autograd.Function):
    @staticmethod
    def forward(ctx: Any, table: torch.Tensor, weights: Weights) -> torch.Tensor:
        ctx.weights = weights
        return weights.matrix @ table.contiguous()

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: torch.Tensor) -> tuple[torch.Tensor, None]:
        return ctx.weights.transposed(gradient), None
