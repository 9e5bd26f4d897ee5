"""Relaxed optimal transport between sets of feature vectors (Kolkin et al. 2019; MeshNCA, equations 4 to 6).

The transport cost is a mean of minima, so its gradient touches one pair per vector. The pairs are found
without gradients in one batched product; the costs of those pairs alone are then evaluated with gradients.
"""

from __future__ import annotations

from typing import Any

import torch
import torch.nn.functional as F

# With fewer channels, rounding does not average out, and float32 costs little.
LOW_PRECISION_CHANNELS = 32
SQUARES = (1e-5, 1e5)  # bounds that a squared distance is clamped to


def relaxed_transport(
    a: torch.Tensor, b: torch.Tensor, euclidean: bool = False, low_precision: bool = False
) -> torch.Tensor:
    """max(W(a, b), W(b, a)) of equation 4, for each pair of sets of a batch.

    The authors multiply colours by a decorrelating matrix first. It is orthogonal: neither cosines nor
    distances change, so it is left out.

    Args:
        a: (K, n, C) feature vectors.
        b: (K, m, C) feature vectors.
        euclidean: adds the squared Euclidean distance, clamped to `SQUARES` and divided by C, to the cosine
            distance (the indicator of equation 4, for colours).
        low_precision: searches the nearest vectors in bfloat16 (the cost of the pairs found stays exact).

    Returns:
        (K,) costs; differentiable in both.
    """
    nearest_b, nearest_a = _matches(a.detach(), b.detach(), euclidean, low_precision)
    forth = _PairCost.apply(a, b, nearest_b, euclidean)
    back = _PairCost.apply(b, a, nearest_a, euclidean)
    return torch.maximum(forth, back)


def moment_distance(a: torch.Tensor, b: torch.Tensor, low_precision: bool = False) -> torch.Tensor:
    """L1 distances of means and of unbiased covariances, averaged over entries (equation 5).

    Args:
        a: (K, n, C) feature vectors.
        b: (K, m, C) feature vectors.
        low_precision: multiplies for the covariances in bfloat16.

    Returns:
        (K,) distances.
    """
    mean_a, mean_b = a.mean(1, keepdim=True), b.mean(1, keepdim=True)
    means = (mean_a - mean_b).abs().mean((1, 2))
    dtype = torch.bfloat16 if low_precision else a.dtype
    return means + (_covariance(a - mean_a, dtype) - _covariance(b - mean_b, dtype)).abs().mean((1, 2))


def channel_transport(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Exact transport between the values of each channel by itself: Wasserstein-1 of their histograms.

    The relaxed cost only asks that every vector finds a near one; this also asks for the right shares.

    Args:
        a: (K, n, C) values.
        b: (K, n, C) values, as many.

    Returns:
        (K,) distances, averaged over channels.
    """
    return (a.sort(1).values - b.sort(1).values).abs().mean((1, 2))


def _covariance(centred: torch.Tensor, dtype: torch.dtype) -> torch.Tensor:
    factor = centred.to(dtype)
    return (factor.mT @ factor).to(centred.dtype) / max(centred.shape[1] - 1, 1)


def _take(vectors: torch.Tensor, index: torch.Tensor) -> torch.Tensor:
    """Rows `index` (K, n) of `vectors` (K, m, C)."""
    offsets = torch.arange(len(vectors), device=vectors.device)[:, None] * vectors.shape[1]
    rows = vectors.reshape(-1, vectors.shape[2])[(index + offsets).reshape(-1)]
    return rows.view(*index.shape, vectors.shape[2])


class _PairCost(torch.autograd.Function):
    """Mean cost (K,) of each vector of x (K, n, C) and the one of y (K, m, C) that `index` (K, n) names.

    With its own derivative, since autograd's goes over these large arrays three times as often; sets whose
    cost the maximum of equation 4 leaves out are passed over.
    """

    @staticmethod
    def forward(
        ctx: Any, x: torch.Tensor, y: torch.Tensor, index: torch.Tensor, euclidean: bool
    ) -> torch.Tensor:
        pair = _take(y, index)
        lengths = [v.norm(dim=-1, keepdim=True).clamp_(min=1e-8) for v in (x, pair)]
        cosine = (x * pair).sum(-1, keepdim=True) / (lengths[0] * lengths[1])
        cost = 1 - cosine
        if euclidean:
            square = (x - pair).square().sum(-1, keepdim=True)
            cost = cost + square.clamp(*SQUARES) / x.shape[-1]
        ctx.euclidean = euclidean
        ctx.save_for_backward(x, y, index, *lengths, cosine)
        return cost.mean((1, 2))

    @staticmethod
    @torch.autograd.function.once_differentiable
    def backward(ctx: Any, gradient: torch.Tensor) -> tuple[torch.Tensor | None, ...]:
        x, y, index, x_length, y_length, cosine = ctx.saved_tensors
        active = gradient.nonzero()[:, 0]
        share = (gradient[active] / x.shape[1])[:, None, None]
        left, right = x[active], _take(y[active], index[active])
        cosine, lengths = cosine[active], (x_length[active], y_length[active])
        across = -share / (lengths[0] * lengths[1])
        along = [share * cosine / length.square() for length in lengths]
        if ctx.euclidean:
            square = (left - right).square().sum(-1, keepdim=True)
            inside = (square >= SQUARES[0]) & (square <= SQUARES[1])
            slope = 2 / x.shape[-1] * share * inside
            across, along = across - slope, [a + slope for a in along]
        gradients: list[torch.Tensor | None] = [None, None]
        if ctx.needs_input_grad[0]:
            gradients[0] = torch.zeros_like(x)
            gradients[0][active] = torch.addcmul(left * along[0], right, across)
        if ctx.needs_input_grad[1]:
            gradients[1] = torch.zeros_like(y)
            places = (index[active] + active[:, None] * y.shape[1]).reshape(-1)
            rows = torch.addcmul(right * along[1], left, across)
            gradients[1].view(-1, y.shape[2]).index_add_(0, places, rows.view(-1, y.shape[2]))
        return *gradients, None, None


@torch.no_grad()
def _matches(
    a: torch.Tensor, b: torch.Tensor, euclidean: bool, low_precision: bool
) -> tuple[torch.Tensor, torch.Tensor]:
    """For each vector of `a` the index of its nearest in `b` (K, n), and the other way round (K, m).

    The order of positive floats is that of their bits, so indices ride in the low bits of the costs through
    one vectorised minimum each (torch's argmin is ten times slower). Costs are thereby compared up to 2^-23
    times the number of places, relative to themselves; in bfloat16 the bits are free.
    """
    cost = _costs(a, b, euclidean, low_precision).clamp_(min=0)
    count, exact = max(cost.shape[1:]), cost.dtype != torch.bfloat16
    low = (1 << (count - 1).bit_length()) - 1
    keys = cost.float().view(torch.int32)
    if exact or low > 0xFFFF:
        keys.bitwise_and_(~low)
    column = torch.arange(cost.shape[2], dtype=torch.int32, device=a.device)
    row = torch.arange(cost.shape[1], dtype=torch.int32, device=a.device)[:, None]
    nearest_b = keys.bitwise_or_(column).amin(2)
    nearest_a = keys.bitwise_xor_(column ^ row).amin(1)
    return nearest_b.bitwise_and_(low).long(), nearest_a.bitwise_and_(low).long()


def _costs(a: torch.Tensor, b: torch.Tensor, euclidean: bool, low_precision: bool) -> torch.Tensor:
    """Costs of all pairs (K, n, m) as one product, with `low_precision` and enough channels in bfloat16.

    The 1 of "1 - cosine" is the product of two further channels: so small costs keep their relative
    precision when the product is rounded.
    """
    one_a, one_b = torch.ones_like(a[..., :1]), torch.ones_like(b[..., :1])
    left, right = [-F.normalize(a, dim=-1, eps=1e-8), one_a], [F.normalize(b, dim=-1, eps=1e-8), one_b]
    if euclidean:
        scale = 1 / a.shape[-1]
        left += [a * (-2 * scale), scale * a.square().sum(-1, keepdim=True), one_a]
        right += [b, one_b, scale * b.square().sum(-1, keepdim=True)]
    dtype = torch.bfloat16 if low_precision and a.shape[-1] >= LOW_PRECISION_CHANNELS else a.dtype
    return torch.cat(left, -1).to(dtype) @ torch.cat(right, -1).to(dtype).mT
