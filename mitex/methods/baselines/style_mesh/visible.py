"""What each pixel of a view counts for, by its depth and the angle at which it sees the surface."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F

from mitex.geometry.vectors import unit
from mitex.mesh import Mesh
from mitex.scenes.cameras import Cameras
from mitex.scenes.stage import Stage

MARGIN = 16  # at least, around what counts, of what a network sees [px]
PERIOD = 32  # of windows [px]: a multiple of 16, of which relu5_1 makes one place; twice it, for fewer sizes


@dataclass(frozen=True, eq=False)
class Visible:
    """What a camera sees of a mesh.

    Attributes:
        depth: (H, W) along the optical axis [mesh units]; infinite where there is no surface.
        cosine: (H, W) of the angle between the surface's normal and the way to the camera, 0 where there is
            no surface or it is seen from behind.
    """

    depth: np.ndarray
    cosine: np.ndarray

    @staticmethod
    def of(stage: Stage, mesh: Mesh, camera: Cameras) -> Visible:
        """From one camera; `stage` is the mesh's."""
        hits = stage.hits(camera)
        hit, face = hits.hit.numpy(), hits.face.numpy()
        points = (hits.barycentric.numpy()[:, :, None] * mesh.vertices[mesh.faces[face]]).sum(1)
        to_camera = camera.origin[0] - points
        depth, cosine = np.full(len(hit), np.inf), np.zeros(len(hit))
        depth[hit] = -to_camera @ unit(camera.target[0] - camera.origin[0])
        normals = unit(mesh.face_crosses[face])
        cosine[hit] = (normals * unit(to_camera)).sum(1).clip(0)
        size = camera.height, camera.width
        return Visible(depth.reshape(size), cosine.reshape(size))

    def height(self, fov: float, texel: float) -> np.ndarray:
        """(H, W) how high a picture [px] must be for a pixel there to be as large as a texel [mesh units]."""
        return 2 * math.tan(0.5 * math.radians(fov)) * self.depth / texel


@dataclass(frozen=True, eq=False)
class Counting:
    """What the pixels of a picture count for.

    Attributes:
        share: (H, W) float32, how much of each belongs to the picture's height.
        weight: (H, W) float32 of the gradients: the share, and the cosine if angles matter.
        areas: one or two of (H, W) bool: the pixels that count; or, if angles matter, those that are seen
            frontally and those that are seen at a slant.
    """

    share: torch.Tensor
    weight: torch.Tensor
    areas: Sequence[torch.Tensor]

    @staticmethod
    def of(visible: Visible, share: np.ndarray, frontal: float | None) -> Counting:
        """Of a view whose pixels have shares (H, W).

        Args:
            frontal: up to which angle a surface is seen frontally [degrees]; None: angles do not matter.
        """
        own, seen = torch.from_numpy(share), torch.from_numpy(share > 0)
        if frontal is None:
            return Counting(own, own, [seen])
        cosine = torch.from_numpy(visible.cosine.astype(np.float32))
        facing = cosine > math.cos(math.radians(frontal))
        return Counting(own, own * cosine, [seen & facing, seen & ~facing])

    def window(self) -> tuple[slice, slice]:
        """Rows and columns that a network has to see: of pixels that count, at least one, and a margin."""
        seen = torch.stack(list(self.areas)).any(0)
        return _window(seen.any(1)), _window(seen.any(0))

    def within(self, window: tuple[slice, slice]) -> Counting:
        """Of that part of the picture."""
        return Counting(self.share[window], self.weight[window], [area[window] for area in self.areas])


def _window(seen: torch.Tensor) -> slice:
    """From the first to the last of places (n,) that are seen, and `MARGIN` more, in whole periods."""
    places = seen.nonzero()[:, 0]
    first, last = int(places[0]) - MARGIN, int(places[-1]) + 1 + MARGIN
    return slice(max(first // PERIOD * PERIOD, 0), min(-(-last // PERIOD) * PERIOD, len(seen)))


def places_in(area: torch.Tensor, size: tuple[int, int]) -> torch.Tensor:
    """Indices of a feature map's places, row by row, whose nearest pixel lies in an area.

    Args:
        area: (H, W) bool.
        size: (h, w) of the map.
    """
    near = F.interpolate(area[None, None].float(), size, mode="nearest")
    return near.flatten().nonzero()[:, 0]


def shares(wanted: np.ndarray, heights: list[int], index: int) -> np.ndarray:
    """How much pixels count in the picture of `heights[index]`.

    They are split between the two pictures whose heights are next to the wanted one; below the lowest and
    above the highest they count there alone. Shares of all pictures add up to 1.
    """
    own = float(heights[index])
    result = np.ones_like(wanted)
    if index > 0:
        below = heights[index - 1]
        result = np.where(wanted < own, np.clip((wanted - below) / (own - below), 0, 1), result)
    if index < len(heights) - 1:
        above = heights[index + 1]
        result = np.where(wanted > own, np.clip((above - wanted) / (above - own), 0, 1), result)
    return result


def cameras_around(count: int, distance: float, fov: float, side: int) -> Cameras:
    """Evenly spread over a sphere around the origin, which they look at, by the golden angle."""
    k = np.arange(count)
    y, angle = 1 - (2 * k + 1) / count, k * math.pi * (3 - math.sqrt(5))
    ring = np.sqrt(1 - y * y)
    origin = distance * np.stack([ring * np.cos(angle), y, ring * np.sin(angle)], 1)
    steep = np.abs(y) > 0.999
    up = np.where(steep[:, None], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0])
    return Cameras("perspective", origin, np.zeros((count, 3)), up, fov=fov, width=side, height=side)
