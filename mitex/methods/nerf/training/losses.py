"""Losses of the radiance-field texture beside that of colour (sections 3.2.3 and 3.3)."""

from __future__ import annotations

import math
from typing import Any

import torch
import torch.nn.functional as F
from torch.autograd.function import once_differentiable

FREE_ANGLE = math.pi / 8  # between normals, without penalty [rad]
SHORT = 1e-4  # composited normals of less length have no direction
PART = 1 << 17  # entries that are compared together: more leave the cache, fewer wake threads too often


def clustering(features: torch.Tensor, centres: torch.Tensor, kappa: float = 1.0) -> torch.Tensor:
    """Draws features to the centres that they are nearest to (equation 3; Xie et al. 2016).

    KL(P || Q), where Q says by Student's t-kernel how much a feature belongs to each centre, and P is Q
    squared, divided by the centres' shares and normalised; P is constant.

    Args:
        features: (N, D) entries of one level.
        centres: (K, D).
        kappa: degrees of freedom of the kernel.

    Returns:
        Scalar: the terms' mean over the N K elements, at least 0 up to rounding; differentiable (once) in
        features and centres.
    """
    return _Clustering.apply(features, centres, kappa)


def distortion(
    weights: torch.Tensor, midpoints: torch.Tensor, widths: torch.Tensor, rays: torch.Tensor
) -> torch.Tensor:
    """Gathers the weights of a ray in one short interval (Barron et al. 2022, equation 15).

    A ray's loss is sum_ij w_i w_j |m_i - m_j| + 1/3 sum_i w_i^2 d_i, here in linear time by prefix sums.

    Args:
        weights: (M,) compositing weights w of the samples of all rays, those of one ray after another.
        midpoints: (M,) places m of the samples along their rays, ascending in each ray.
        widths: (M,) lengths d of the samples' intervals, in the same units.
        rays: (M,) integers, the rays that the samples are on; equal ones are adjacent.

    Returns:
        Scalar: the mean over the rays that have samples, 0 without any.
    """
    # The sums run over all rays; their differences are as good as the weights only in float64.
    w, m, d = weights.double(), midpoints.double(), widths.double()
    _, lengths = torch.unique_consecutive(rays, return_counts=True)
    starts = (lengths.cumsum(0) - lengths).repeat_interleave(lengths)
    mass, moment = (_before(x, starts) for x in (w, w * m))
    total = (2 * w * (m * mass - moment) + w.square() * d / 3).sum()
    return (total / max(len(lengths), 1)).to(weights.dtype)


def normal_agreement(predicted: torch.Tensor, target: torch.Tensor) -> torch.Tensor:
    """-min(cos, cos(pi / 8)) of the angles between normals, averaged: what equation 5 means.

    As printed, equation 5 rewards only angles below pi / 8; noise in the target asks for the contrary.

    Args:
        predicted: (R, 3) fine normals composited along R rays, of any length.
        target: (R, 3) target directions, of any length; constant.

    Returns:
        Scalar in [-cos(pi / 8), 1], without a derivative where the angle is below pi / 8.
    """
    cosine = F.cosine_similarity(predicted, target.detach(), dim=1, eps=SHORT)
    return -cosine.clamp(max=math.cos(FREE_ANGLE)).mean()


class _Clustering(torch.autograd.Function):
    """The loss and its derivative in closed form, a part of the entries at a time.

    Autograd takes three times as long for a whole table. In float64: the features start within 1e-4, and P
    and Q are then equal to float32's precision.
    """

    @staticmethod
    def forward(ctx: Any, features: torch.Tensor, centres: torch.Tensor, kappa: float) -> torch.Tensor:
        # Features along the last axis: sums over the few centres are slow there.
        x, c = features.double().T.contiguous()[:, None], centres.double().T[:, :, None]
        inverse = x.new_empty(len(centres), len(features))
        q, forces, pull = torch.empty_like(inverse), torch.empty_like(x[:, 0]), torch.zeros_like(c[:, :, 0])
        parts = [slice(start, start + PART) for start in range(0, len(features), PART)]
        for part in parts:
            squares = (x[..., part] - c).square_().sum(0)
            inverse[:, part] = squares.div_(kappa).add_(1).reciprocal_()
            kernel = inverse[:, part] ** (0.5 * (kappa + 1))
            torch.div(kernel, kernel.sum(0), out=q[:, part])
        shares, divergence = q.sum(1, keepdim=True), x.new_zeros(())
        for part in parts:
            p = q[:, part].square().div_(shares)
            p /= p.sum(0)
            divergence += (p / q[:, part]).log_().mul_(p).sum()
            force = p.sub_(q[:, part]).mul_(inverse[:, part])
            force = (x[..., part] - c).mul_(force)
            torch.sum(force, 1, out=forces[:, part])
            pull -= force.sum(2)
        ctx.save_for_backward(forces, pull)
        ctx.scale, ctx.dtypes = (kappa + 1) / kappa / q.numel(), (features.dtype, centres.dtype)
        return (divergence / q.numel()).to(features.dtype)

    @staticmethod
    @once_differentiable
    def backward(ctx: Any, gradient: torch.Tensor) -> tuple[torch.Tensor, torch.Tensor, None]:
        forces, pull = (saved.T * (gradient.double() * ctx.scale) for saved in ctx.saved_tensors)
        return forces.to(ctx.dtypes[0]), pull.to(ctx.dtypes[1]), None


def _before(values: torch.Tensor, starts: torch.Tensor) -> torch.Tensor:
    """For each value the sum of those before it that are at or after its start."""
    sums = values.cumsum(0) - values
    return sums - sums[starts]
