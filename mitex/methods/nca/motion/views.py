"""Grey pictures of a texture that moves, and the motion that they should show."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import torch

from mitex.colour import LUMINANCE
from mitex.methods.nca.look import Look
from mitex.methods.nca.motion.tangent_field import TangentField
from mitex.methods.nca.surfaces import TrainingMesh, TrainingPlane, Windows
from mitex.scenes.cameras import Cameras
from mitex.scenes.screen import surface_motion

STILL = 1e-6  # [px] in a period
RIM = 4  # pixels along a silhouette, where an estimator's windows see the background, which stands still


@dataclass(frozen=True, eq=False)
class MotionViews:
    """K views of a surface.

    Attributes:
        grey: of a state (V, C), its luminance (K, 1, H, W), differentiable in the state.
        target: (K, 2, H, W) the field in the motion's period [px]; x to the right, y down.
        mask: (K, H, W) bool, where the surface is, but for a margin along silhouettes.
    """

    grey: Callable[[torch.Tensor], torch.Tensor]
    target: torch.Tensor
    mask: torch.Tensor

    def steps_within(self, pixels: float, period: float) -> int:
        """Automaton steps in which nothing moves farther, at least one; the period has `period`."""
        farthest = float((self.target.norm(dim=1) * self.mask).max())
        return max(int(pixels * period / max(farthest, STILL)), 1)


def mesh_views(look: Look, field: TangentField, cameras: Cameras) -> MotionViews:
    """Of a mesh, as cameras see it."""
    surface = field.surface
    assert isinstance(surface, TrainingMesh)
    hits = surface.stage.hits(cameras)
    target = surface_motion(cameras, surface.mesh, hits, surface.edge * field.vectors)
    return MotionViews(
        lambda state: _grey(look, surface.views(look, state, cameras)),
        torch.from_numpy(target).permute(0, 3, 1, 2).to(look.device),
        without_rim(hits.hit.view(cameras.shape)).to(look.device),
    )


def without_rim(mask: torch.Tensor) -> torch.Tensor:
    """(K, H, W) bool: where a mask is true as far as `RIM` pixels to all sides, inside the picture."""
    outside = torch.nn.functional.max_pool2d((~mask)[:, None].float(), 2 * RIM + 1, 1, RIM)
    return outside[:, 0] == 0


def plane_views(look: Look, field: TangentField, windows: Windows) -> MotionViews:
    """Of a flat square, in windows."""
    plane = field.surface
    assert isinstance(plane, TrainingPlane)
    right, up = plane.axes @ field.vectors[0] * (windows.pixels / (windows.width * plane.lattice.columns))
    size = len(windows.corners), windows.pixels, windows.pixels
    target = torch.tensor([right, -up], dtype=torch.float32, device=look.device)
    return MotionViews(
        lambda state: _grey(look, plane.windows(look, state, windows)),
        target[:, None, None].expand(size[0], -1, *size[1:]),
        torch.ones(size, dtype=torch.bool, device=look.device),
    )


def _grey(look: Look, views: torch.Tensor) -> torch.Tensor:
    """The luminance (K, 1, H, W) of views (K, H, W, C) of the maps' values."""
    albedo = views[..., list(look.layout["albedo"])]
    return (albedo @ albedo.new_tensor(LUMINANCE))[:, None]
