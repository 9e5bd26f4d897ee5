"""How much a measured motion of pictures is the desired one (MeshNCA, equations 11 to 14)."""

from __future__ import annotations

from typing import NamedTuple

import torch

LEAST = 0.05  # of the mean length of the target: shorter vectors have no direction to speak of
TINY = 1e-6  # [px], under which a length has no gradient


class MotionLoss(NamedTuple):
    """The loss of a motion, and its parts; scalars.

    Attributes:
        direction: 1 - cos of the angle between the two motions, from 0 to 2 (equation 11).
        strength: difference of their lengths [px] (equation 12).
        total: both (equation 13), to be added to the appearance loss with a weight (equation 14).
    """

    direction: torch.Tensor
    strength: torch.Tensor
    total: torch.Tensor


def motion_loss(
    flow: torch.Tensor,
    target: torch.Tensor,
    mask: torch.Tensor | None = None,
    *,
    steps: int,
    period: float,
    gamma: float,
) -> MotionLoss:
    """Compares the motion from one picture to another with the desired one.

    The direction's part and the strength's are::

        L_dir = mean(1 - cos(U_gen, U_2D))
        L_str = mean |T |U_gen| / n - |U_2D||

    Their combination is L_dir while the direction is wrong (L_dir >= 1), else (1 - L_dir) L_str +
    gamma L_dir, so that the direction comes first. Its factor 1 - L_dir has no gradient: where the strength
    is off by more than gamma, a descent would else lessen the factor by turning to a wrong direction.

    Means are over all pixels of all pictures that count: those in the mask whose target is longer than
    `LEAST` times the mean there. The paper's are over all, background included.

    Args:
        flow: U_gen (B, 2, H, W), measured, from the first picture to the second [px]; x right, y down.
        target: U_2D (B, 2, H, W), in `period` steps [px].
        mask: (B, H, W) bool, where the surface is seen whole; None for everywhere.
        steps: n, of the automaton, between the two pictures.
        period: T.
        gamma: weight of the direction, once it is right.

    Returns:
        The loss, differentiable in the flow; zeros where no pixel counts.
    """
    length = target.norm(dim=1)
    mask = torch.ones_like(length, dtype=torch.bool) if mask is None else mask
    mean = (length * mask).sum() / mask.sum().clamp(min=1)
    mask = mask & (length > LEAST * mean)
    count = mask.sum().clamp(min=1)
    speed = flow.square().sum(1).clamp(min=TINY**2).sqrt()
    cosine = (flow * target).sum(1) / (speed * length.clamp(min=TINY))
    direction = ((1 - cosine) * mask).sum() / count
    strength = ((period / steps * speed - length).abs() * mask).sum() / count
    both = (1 - direction).detach() * strength + gamma * direction
    return MotionLoss(direction, strength, torch.where(direction >= 1, direction, both))
