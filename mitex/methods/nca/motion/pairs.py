"""Pictures of the same places before and after a texture moved, and the motion that they should show."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch

from mitex.colour import LUMINANCE
from mitex.geometry.triangles import interpolate
from mitex.methods.nca.look import Look
from mitex.methods.nca.motion.drift import Drift
from mitex.methods.nca.surfaces import TrainingPlane, TrainingSphere, Windows
from mitex.scenes.cameras import Cameras
from mitex.scenes.screen import screen_motion


@dataclass(frozen=True, eq=False)
class Pairs:
    """K pairs of grey pictures.

    Attributes:
        first, second: (K, 1, H, W), differentiable in the states.
        target: (K, 2, H, W) the drift in the motion's period [px]; x to the right, y down.
        mask: (K, H, W) bool, where the surface is.
    """

    first: torch.Tensor
    second: torch.Tensor
    target: torch.Tensor
    mask: torch.Tensor


def sphere_pairs(look: Look, states: Sequence[torch.Tensor], drift: Drift, cameras: Cameras) -> Pairs:
    """Of two states (V, C) of a sphere, as cameras see them."""
    sphere = drift.surface
    assert isinstance(sphere, TrainingSphere)
    first, second = (_grey(look, sphere.views(look, state, cameras)) for state in states)
    hits = sphere.stage.hits(cameras)
    corners = sphere.mesh.faces[hits.face.numpy()]
    weights = hits.barycentric.numpy().astype(np.float64)
    points, field = (interpolate(weights, values[corners]) for values in (sphere.mesh.vertices, drift.field))
    hit = hits.hit.numpy()
    camera = np.flatnonzero(hit) // (cameras.width * cameras.height)
    motion = np.zeros((len(hit), 2))
    motion[hit] = screen_motion(cameras, camera, points, sphere.edge * field)
    size = cameras.shape
    target = torch.from_numpy(motion.astype(np.float32)).view(*size, 2).permute(0, 3, 1, 2)
    return Pairs(first, second, target.to(first.device), hits.hit.view(size).to(first.device))


def plane_pairs(look: Look, states: Sequence[torch.Tensor], drift: Drift, windows: Windows) -> Pairs:
    """Of two states (V, C) of a flat square, in windows."""
    plane = drift.surface
    assert isinstance(plane, TrainingPlane)
    first, second = (_grey(look, plane.windows(look, state, windows)) for state in states)
    right, up = plane.axes @ drift.field[0] * (windows.pixels / (windows.width * plane.lattice.columns))
    target = first.new_tensor([right, -up])[:, None, None].expand(len(first), -1, *first.shape[2:])
    return Pairs(first, second, target, torch.ones_like(first[:, 0], dtype=torch.bool))


def _grey(look: Look, views: torch.Tensor) -> torch.Tensor:
    """The luminance (K, 1, H, W) of views (K, H, W, C) of the maps' values."""
    albedo = views[..., list(look.layout["albedo"])]
    return (albedo @ albedo.new_tensor(LUMINANCE))[:, None]
