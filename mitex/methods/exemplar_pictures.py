"""The exemplar beside a view: how large it is there, and how previews show it."""

from __future__ import annotations

import numpy as np
import torch

from mitex.exemplar import Exemplar

LEAST = 32  # side of the exemplar beside a view [px], which five layers need


def albedo(exemplar: Exemplar, side: int) -> torch.Tensor:
    """(side, side, 3) sRGB in [0, 1] of the exemplar's central square."""
    return torch.from_numpy(exemplar.resized(side).maps["albedo"])


def side_in_view(width: float, view: int, height: float) -> int:
    """Side of the exemplar [px] with which its pixels are as large as they are on the mesh, in a view of it.

    Args:
        width: side of the exemplar on the mesh.
        view: height of the view [px].
        height: of what the view shows at the distance of the mesh, in the unit of `width`.
    """
    return min(max(round(width * view / height), LEAST), 4 * view)


def framed(exemplar: Exemplar, side: int, frame: int) -> np.ndarray:
    """(frame, frame, 3) sRGB, black but for the exemplar of this side in the corner, as far as it fits."""
    picture = albedo(exemplar, side).numpy()[:frame, :frame]
    return np.pad(picture, ((0, frame - len(picture)), (0, frame - len(picture)), (0, 0)))
