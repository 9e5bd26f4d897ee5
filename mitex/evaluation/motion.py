"""How well a texture moves as it should, seen in rendered frames."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F

from mitex.colour import LUMINANCE
from mitex.errors import ConfigError, ImageError
from mitex.features.flow import EstimatorName, load_estimator, smaller_eigenvalue

LEAST_SPEED = 0.05  # of the mean speed: slower targets have no direction that counts
DETAIL = 0.05  # smaller eigenvalue at which a pixel counts half
MARGIN = 8  # from what is outside the mask: silhouettes do not move with the texture [px]


@dataclass(frozen=True)
class MotionErrors:
    """A motion beside the one that it should be, averaged with weights.

    Attributes:
        direction: angle between the two [degrees], 0 to 180.
        speed_ratio: speed over the speed that it should have.
        speed_spread: standard deviation of that ratio from place to place.
        end_point: length of the difference [px].
    """

    direction: float
    speed_ratio: float
    speed_spread: float
    end_point: float


def motion_errors(motion: torch.Tensor, target: torch.Tensor, weight: torch.Tensor) -> MotionErrors:
    """Errors of a motion that is known by other means.

    Args:
        motion: (B, 2, H, W) [px].
        target: (B, 2, H, W) [px].
        weight: (B, H, W), how much each pixel counts; 0 where the target does not move.

    Raises:
        ConfigError: no pixel counts.
    """
    counting = weight > 0
    if not counting.any():
        raise ConfigError(
            "there is no pixel to measure motion at", "give a larger mask, or a target that moves there"
        )
    weight = weight[counting].double() / weight[counting].double().sum()
    motion, target = (field.movedim(1, -1)[counting].double() for field in (motion, target))
    speed, target_speed = motion.norm(dim=1), target.norm(dim=1)
    across = motion[:, 0] * target[:, 1] - motion[:, 1] * target[:, 0]
    angle = torch.atan2(across.abs(), (motion * target).sum(1))
    ratio = speed / target_speed
    mean = (weight * ratio).sum()
    return MotionErrors(
        direction=float((weight * angle.rad2deg()).sum()),
        speed_ratio=float(mean),
        speed_spread=float((weight * (ratio - mean).square()).sum().sqrt()),
        end_point=float((weight * (motion - target).norm(dim=1)).sum()),
    )


def measured_motion(
    frames: np.ndarray,
    target: np.ndarray,
    mask: np.ndarray,
    *,
    steps: float,
    period: float,
    judge: EstimatorName = "lucas-kanade",
) -> MotionErrors:
    """How the texture in a film moves, beside how it should.

    The judge estimates the motion from each frame to the next, which should be (steps / period) * target. A
    pixel counts by the smaller eigenvalue e of its surroundings' structure tensor, as e / (e + 0.05): not
    where the picture is plain or striped. Pixels outside the mask do not count, nor those within 8 pixels of
    them, where the unmoving silhouette is seen, nor those whose target is under 5 % of the mean speed.

    Args:
        frames: (N, H, W, 3) sRGB in [0, 1], N at least 2, of one unmoving view.
        target: (H, W, 2), motion in a unit of time [px]: x to the right, y down (the `motion` integrator).
        mask: (H, W), above 0 where the surface is seen and its motion counts.
        steps: of the automaton from one frame to the next, so few that nothing moves by more than 4 pixels.
        period: steps of the automaton in a unit of time.
        judge: Lucas and Kanade's method, which has no weights, or the flow network. The one that a texture
            was not trained by is the fairer.

    Raises:
        ImageError: frames of another shape, or smaller than 32 x 32 pixels.
        ConfigError: a target or mask of another size or with values that are not finite; no time passes; the
            mask is too small, or the target 0 inside it.
    """
    frames, target, mask = (np.asarray(array, np.float32) for array in (frames, target, mask))
    if frames.ndim != 4 or frames.shape[3] != 3 or len(frames) < 2:
        raise ImageError(f"a film of shape {frames.shape}", "give (N, H, W, 3), two frames or more")
    size = frames.shape[1:3]
    if target.shape != (*size, 2) or mask.shape != size:
        shapes = f"target of shape {target.shape} and mask of shape {mask.shape}"
        raise ConfigError(shapes, f"give {(*size, 2)} and {size}, as the frames")
    if not (np.isfinite(frames).all() and np.isfinite(target).all() and np.isfinite(mask).all()):
        raise ConfigError(
            "frames, target or mask hold NaN or infinite values",
            "set to 0 what is not known, and leave it out of the mask",
        )
    if not (steps > 0 and period > 0):
        raise ConfigError(f"{steps} steps in a period of {period}", "give numbers above 0")
    grey = torch.from_numpy(frames @ LUMINANCE)[:, None]
    first, second = grey[:-1], grey[1:]
    expected = torch.tensor(target).movedim(2, 0)[None] * (steps / period)
    estimate = load_estimator(judge)
    with torch.no_grad():
        pairs = zip(first.split(1), second.split(1), strict=True)  # a film at once may not fit in memory
        motion = torch.cat([estimate(*pair) for pair in pairs])
        detail = torch.cat([smaller_eigenvalue(frame) for frame in first.split(1)]).clamp_min(0)
    weight = _counting(expected, torch.tensor(mask)) * detail / (detail + DETAIL)
    return motion_errors(motion, expected.expand_as(motion), weight)


def _counting(target: torch.Tensor, mask: torch.Tensor) -> torch.Tensor:
    """(1, H, W): 1 where a motion counts, else 0; target (1, 2, H, W), mask (H, W)."""
    inside = 1 - F.max_pool2d((mask[None] <= 0).float(), 2 * MARGIN + 1, 1, MARGIN)
    speed = target.norm(dim=1)
    return inside * (speed > LEAST_SPEED * (inside * speed).sum() / inside.sum())
