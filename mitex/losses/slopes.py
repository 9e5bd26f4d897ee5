"""Whether the normals of a surface are those of its heights."""

from __future__ import annotations

import torch
import torch.nn.functional as F

STEEPEST = 0.1  # z of the flattest normals whose slopes are computed


def slope_correlation(height: torch.Tensor, normal: torch.Tensor) -> torch.Tensor:
    """Correlation (K,) of the slopes of height maps (K, h, w) with those that normal maps say.

    Both are smoothed over three pixels, and slopes along x and y count together. The heights' unit does not
    matter: 1 if normals are those of the heights times any positive factor.

    Args:
        height: any unit, larger is higher; row 0 is the top.
        normal: (K, h, w, 3), encoded into [0, 1]; x points right, y up.
    """
    x, y, z = (2 * normal - 1).unbind(3)
    z = z.clamp(min=STEEPEST)
    # A normal is along (-dh/dx, -dh/dy, 1), and rows go down.
    slopes = torch.stack([-x / z, y / z], 1)
    smooth = F.avg_pool2d(torch.cat([height[:, None], slopes], 1), 3, stride=1)
    rises = smooth[:, 0]
    across = 0.5 * (rises[:, 1:-1, 2:] - rises[:, 1:-1, :-2])
    down = 0.5 * (rises[:, 2:, 1:-1] - rises[:, :-2, 1:-1])
    a = torch.stack([across, down], 1).flatten(1)
    b = smooth[:, 1:, 1:-1, 1:-1].flatten(1)
    a, b = (c - c.mean(1, keepdim=True) for c in (a, b))
    return (a * b).sum(1) / (a.square().sum(1) * b.square().sum(1)).clamp(min=1e-20).sqrt()
