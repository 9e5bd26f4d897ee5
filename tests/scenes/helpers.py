"""What several tests of rendering need."""

from typing import Any, Literal

import numpy as np
import torch

from mitex.scenes import Cameras


def front_camera(
    kind: Literal["perspective", "orthographic"], distance: float = 3.0, **options: Any
) -> Cameras:
    """One camera on the +z axis that looks at the origin, up +y."""
    origin, target, up = (np.array([v], np.float32) for v in ((0, 0, distance), (0, 0, 0), (0, 1, 0)))
    return Cameras(kind, origin, target, up, **options)


def gradient(tensor: torch.Tensor) -> np.ndarray:
    """The gradient that a backward pass left on a tensor."""
    assert tensor.grad is not None
    return tensor.grad.numpy()


def live_variables() -> int:
    """Number of Dr.Jit variables, give or take a constant."""
    from mitex.runtime.jit import dr

    return len(str(dr.whos(as_string=True)).splitlines())
