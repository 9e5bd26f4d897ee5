"""What a relief and its exemplar look like without light: normals, heights, and both with colours."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import torch
import torch.nn.functional as F

from mitex.bridge import lookup
from mitex.exemplar import Exemplar
from mitex.mesh import Mesh
from mitex.methods.neural_style.figure import smooth_normals
from mitex.methods.relief.shape import Shape
from mitex.scenes.cameras import Cameras, patch_views
from mitex.scenes.stage import Stage

FACING = 0.6  # cosine between view and normal of the surface below, from which on a pixel counts
DEEP = 0.5  # what lies further before or behind the middle of a close-up does not count [its sides]
EXTREMES = (1, 99)  # percentiles of the exemplar's heights that are black and white


class Pictures:
    """Kinds of pictures, as RGB in [0, 1]; their number is `kinds`.

    The first shows normals in the frame of the surface below the relief, whose right is that of the picture,
    as a normal map does; the second heights in grey. Two more, if there are colours and `joint` asks for
    them, show height, brightness of the colours and one of the normals' slopes as red, green and blue: they
    have the exemplar's features only where all three fit together.

    Args:
        exemplar: with height and normal maps, as wide as it shall be in close-ups.
        joint: whether there are the latter two.
    """

    def __init__(self, exemplar: Exemplar, joint: bool) -> None:
        self.joint = joint and "albedo" in exemplar.maps
        maps = {name: torch.tensor(values) for name, values in exemplar.maps.items()}
        self._low, high = np.percentile(exemplar.maps["height"], EXTREMES)
        self._range = max(float(high - self._low), 1e-6)
        self._mean = float(exemplar.maps["height"].mean())
        grey = maps["albedo"].mean(2, keepdim=True) if self.joint else None
        self.exemplar = self._stacked(maps["normal"], maps["height"] - self._mean, grey)

    @property
    def kinds(self) -> int:
        return len(self.exemplar)

    def of(self, normals: torch.Tensor, heights: torch.Tensor, colours: torch.Tensor | None) -> torch.Tensor:
        """(K, `kinds`, H, W, 3).

        Args:
            normals: (K, H, W, 3) map values in [0, 1].
            heights: (K, H, W, 1), 0 in the mean [depths of the relief].
            colours: (K, H, W, 3) sRGB, if there are any.
        """
        grey = colours.mean(3, keepdim=True) if colours is not None and self.joint else None
        return self._stacked(normals, heights, grey).movedim(0, 1)

    def _stacked(
        self, normals: torch.Tensor, heights: torch.Tensor, grey: torch.Tensor | None
    ) -> torch.Tensor:
        height = (heights + (self._mean - self._low)) / self._range
        pictures = [normals, height.expand_as(normals)]
        if grey is not None:
            pictures += [torch.cat([height, grey, normals[..., k : k + 1]], -1) for k in (0, 1)]
        return torch.stack(pictures)


class CloseUps:
    """Close-ups of a relief.

    What they see is traced on the moved surface without derivatives; gradients reach its vertices through
    heights and normals.

    Args:
        mesh: coarse, around which cameras are placed.
        directions: (V, 3) where right in the pictures points at its vertices.
        shape: the same surface, whose vertices move.
        colours: (W, 3) of the shape's vertices, sRGB; None without.
        pictures: kinds of pictures.
        depth: of the relief [the shape's units].
    """

    def __init__(
        self,
        mesh: Mesh,
        directions: np.ndarray,
        shape: Shape,
        colours: np.ndarray | None,
        pictures: Pictures,
        depth: float,
    ) -> None:
        self._mesh, self._directions, self._shape = mesh, directions, shape
        self._pictures, self._depth = pictures, depth
        self._faces = torch.tensor(shape.mesh.faces, dtype=torch.int64)
        self._stage = Stage(shape.mesh)
        plain = torch.zeros(len(shape.mesh.vertices), 3)
        self._fixed = torch.cat(
            [
                shape.normals,
                torch.tensor(shape.mesh.vertices),
                plain if colours is None else torch.from_numpy(colours.astype(np.float32)),
            ],
            1,
        )

    def cameras(self, generator: torch.Generator, count: int, width: float, pixels: int) -> Cameras:
        """Random ones that look at squares of this width, from so near that they see into hollows."""
        views = patch_views(generator, self._mesh, count, 0.5 * width, pixels, self._directions)
        return replace(views, origin=views.target - DEEP * width * views.axes()[2])

    def __call__(self, offsets: torch.Tensor, cameras: Cameras) -> tuple[torch.Tensor, torch.Tensor]:
        """Pictures (K, kinds, H, W, 3) of the surface with these offsets, and (K, H, W) bool, which pixels
        count; others are grey."""
        moved = self._shape.moved(offsets)
        self._stage.move(moved.detach().numpy())
        visibility = self._stage.visibility(cameras)
        field = [self._shape.heights(offsets) / self._depth, smooth_normals(moved, self._faces), self._fixed]
        heights, normals, below, places, colours = lookup(torch.cat(field, 1), visibility).split(
            [1, 3, 3, 3, 3], 3
        )
        below, normals = F.normalize(below, dim=3), F.normalize(normals, dim=3)
        right, _, forward = (torch.from_numpy(axis)[:, None, None] for axis in cameras.axes())
        far = ((places - torch.from_numpy(cameras.target)[:, None, None]) * forward).sum(3).abs()
        facing = -(below * forward).sum(3)
        counts = (visibility.coverage > 0) & (facing > FACING) & (far < 2 * DEEP * cameras.half_width)
        pictures = self._pictures.of(in_frame(normals, below, right), heights, colours)
        return torch.where(counts[:, None, :, :, None], pictures, 0.5), counts


def in_frame(normals: torch.Tensor, below: torch.Tensor, right: torch.Tensor) -> torch.Tensor:
    """Unit normals (..., 3) as map values, in the frame of others.

    Args:
        normals: that are told.
        below: of the surface that they belong to.
        right: the frame's first axis, as far as it lies across `below`.
    """
    x = F.normalize(right - (right * below).sum(-1, keepdim=True) * below, dim=-1)
    y = torch.linalg.cross(below, x)
    local = torch.stack([(normals * axis).sum(-1) for axis in (x, y, below)], -1)
    return 0.5 + 0.5 * local
