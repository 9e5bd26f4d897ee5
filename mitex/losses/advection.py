"""Whether values on a surface move along a vector field: no camera and no network is needed to tell."""

from __future__ import annotations

import torch


def advection_residual(
    before: torch.Tensor, after: torch.Tensor, upstream: torch.Tensor, floor: float = 0.0
) -> torch.Tensor:
    """What a transport leaves undone, as a share of what it has to do::

        |S(t + n)(x) - S(t)(x - d)|^2 / |S(t)(x - d) - S(t)(x)|^2

    d = (n / T) U is the way of the field U in n steps, if its unit is a unit of length in T steps. To the
    first order of d, S(t)(x - d) is S(t) - (n / T) U . grad S(t). Values from upstream are right for ways of
    any length, while the gradient is wrong as soon as d is a fair part of what repeats in S.

    The denominator is what a state leaves undone that stays as it is. So 0 is a perfect transport, 1 none at
    all, and neither the scale of the values nor how smooth they are matters: a state that fades to grey gains
    nothing. It has no gradient, nor has `before`: only what happens afterwards can be better or worse.

    Any change is large beside a very short way. With a floor, the denominator is larger by that share of the
    variance of S(t), so that ways need not be long for the residual to be a measure of them; without a way,
    it tells how still S stands.

    Args:
        before: S(t), (V, C).
        after: S(t + n), (V, C).
        upstream: S(t)(x - d), (V, C).
        floor: share of the variance over the vertices, 0 or more.

    Returns:
        Sums over vertices and channels, divided; a scalar, differentiable in `after`.
    """
    before, upstream = before.detach(), upstream.detach()
    way = (upstream - before).square().sum() + floor * (before - before.mean(0)).square().sum()
    return (after - upstream).square().sum() / way.clamp(min=torch.finfo(way.dtype).tiny)
