"""What several tests of rendering need."""

from typing import Any, Literal

import numpy as np
import torch

from mitex.mesh import Similarity
from mitex.scenes import Cameras


def front_camera(
    kind: Literal["perspective", "orthographic"], distance: float = 3.0, **options: Any
) -> Cameras:
    """One camera on the +z axis that looks at the origin, up +y."""
    origin, target, up = (np.array([v], np.float32) for v in ((0, 0, distance), (0, 0, 0), (0, 1, 0)))
    return Cameras(kind, origin, target, up, **options)


def shell_scene(
    field: Any,
    *,
    fov: float,
    side: int,
    place: Similarity | None = None,
    turn: np.ndarray | None = None,
    **entries: Any,
) -> Any:
    """A scene with a field, which a camera on the +z axis sees from a distance of 4 in side x side pixels."""
    from mitex.runtime.jit import mi
    from mitex.textures.shell_field import shell_field

    carried = shell_field(field, place or Similarity(np.zeros(3), 1.0), turn)
    scene = {
        "type": "scene",
        "integrator": {"type": "shell", "field": carried},
        "sensor": {
            "type": "perspective",
            "fov": fov,
            "to_world": mi.ScalarTransform4f().look_at([0, 0, 4], [0, 0, 0], [0, 1, 0]),
            "film": {"type": "hdrfilm", "width": side, "height": side, "rfilter": {"type": "box"}},
        },
    }
    return mi.load_dict(scene | entries)


def gradient(tensor: torch.Tensor) -> np.ndarray:
    """The gradient that a backward pass left on a tensor."""
    assert tensor.grad is not None
    return tensor.grad.numpy()


def live_variables() -> int:
    """Number of Dr.Jit variables, give or take a constant."""
    from mitex.runtime.jit import dr

    return len(str(dr.whos(as_string=True)).splitlines())
