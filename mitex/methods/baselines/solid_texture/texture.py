"""`SolidTexture`: a solid that any mesh can be cut out of."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.asset import Asset
from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.methods.baselines.solid_texture import METHOD
from mitex.methods.baselines.solid_texture.boxes import Box
from mitex.methods.baselines.solid_texture.generator import (
    NOISE,
    Generator,
    noise_boxes,
    shapes,
    statistic_shapes,
)
from mitex.methods.baselines.solid_texture.noise import hashed_noise
from mitex.methods.checks import in_range
from mitex.methods.layout import RESOLUTION, layout_side, with_layout
from mitex.methods.point_colours import with_colours
from mitex.progress import counted
from mitex.ranges import SCALES, SEEDS, TEXELS
from mitex.runtime import keep_freed_memory
from mitex.training import model_file

BLOCK = 32  # side of the boxes that a solid is made in [voxels]
MOST_BLOCKS = 20_000  # an hour on two cores


@dataclass(frozen=True, eq=False)
class SolidTexture:
    """Colours of space.

    Attributes:
        generator: the network.
        voxels: along the exemplar's width.
        width: of the exemplar on a mesh [sides of a layout's square].
        about: how it was made.
    """

    generator: Generator
    voxels: int
    width: float
    about: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, source: str | Path) -> SolidTexture:
        """Reads a run folder or a model file.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        with model_file.opened(source, METHOD.name) as (tensors, about):
            voxels, width = int(tensors.pop("voxels")), float(tensors.pop("width"))
            if voxels < 1 or not 0 < width < np.inf:
                raise ValueError("an exemplar without a size")
            every = model_file.of_shapes(tensors, shapes() | statistic_shapes())
            weights, statistics = ({k: every[k] for k in own} for own in (shapes(), statistic_shapes()))
            return cls(Generator(weights, statistics), voxels, width, about)

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors).

        Raises:
            OutputError: the place is not writable.
        """
        sizes = {"voxels": torch.tensor(self.voxels), "width": torch.tensor(self.width, dtype=torch.float64)}
        tensors = {**self.generator.tensors, **self.generator.statistics, **sizes}
        return model_file.save(path, tensors, METHOD.name, self.about)

    def apply(
        self,
        mesh: Mesh,
        *,
        seed: int = 0,
        scale: float = 1.0,
        resolution: int = 512,
        keep_uvs: bool = False,
    ) -> Asset:
        """Cuts a mesh out of the solid: each texel has the colour of its place in space.

        Args:
            mesh: any.
            seed: of the noise, from 0 to 2^32 - 1: another one, another solid.
            scale: size of the pattern.
            resolution: side of the asset's albedo [texels], 16 to 8192.
            keep_uvs: use the mesh's own UVs.

        Returns:
            The mesh with an albedo texture, without seams.

        Raises:
            ConfigError: the seed or another number is out of range, or too much of the solid would be needed.
        """
        in_range("`seed`", seed, *SEEDS)
        in_range("`scale`", scale, *SCALES)
        in_range("`resolution`", resolution, *TEXELS)
        unwrapped = with_layout(mesh, RESOLUTION, keep_uvs)
        edge = scale * self.width * layout_side(unwrapped) / self.voxels
        low = unwrapped.vertices.min(0)
        keep_freed_memory()

        def colours(points: np.ndarray) -> np.ndarray:
            return self.at((points - low) / edge, seed)

        return with_colours(unwrapped, resolution, colours, mesh.name)

    @torch.no_grad()
    def at(self, points: np.ndarray, seed: int = 0) -> np.ndarray:
        """The solid's colours, interpolated between the centres of its voxels.

        Args:
            points: (N, 3) places [voxels]; the centre of voxel (0, 0, 0) is the origin.
            seed: of the noise.

        Returns:
            (N, 3) float32 sRGB in [0, 1].

        Raises:
            ConfigError: the points lie in too many blocks of voxels.
        """
        blocks, index = np.unique(np.floor(points / BLOCK).astype(np.int64), axis=0, return_inverse=True)
        if len(blocks) > MOST_BLOCKS:
            raise ConfigError(
                f"a pattern so small needs {len(blocks):,} blocks of the solid", "use a larger scale"
            )
        order = np.argsort(index.ravel(), kind="stable")
        ends = np.cumsum(np.bincount(index.ravel(), minlength=len(blocks)))
        result = np.empty((len(points), 3), np.float32)
        parts = np.split(order, ends[:-1])
        pairs = list(zip(blocks, parts, strict=True))
        for block, rows in counted("cutting the solid", pairs, len(blocks)):
            result[rows] = interpolated(self.block(tuple(BLOCK * block), seed), points[rows] - BLOCK * block)
        return result

    def block(self, start: tuple[int, ...], seed: int) -> np.ndarray:
        """(3, 33, 33, 33) sRGB in [0, 1] of the voxels from `start` on, a last one shared with the next."""
        box = Box(tuple(int(s) for s in start), (BLOCK + 1,) * 3)
        hashed = partial(hashed_noise, channels=NOISE, seed=seed)
        noise = [torch.from_numpy(hashed(b, scale=k))[None] for k, b in enumerate(noise_boxes(box))]
        return self.generator.colours(box, noise)[0].clamp(0, 1).numpy()


def interpolated(values: np.ndarray, points: np.ndarray) -> np.ndarray:
    """(N, C) of a grid (C, X, Y, Z) at places (N, 3) [voxels], trilinearly."""
    corner = np.clip(np.floor(points).astype(int), 0, np.array(values.shape[1:]) - 2)
    share = points - corner
    result = np.zeros((len(points), len(values)), np.float32)
    for offset in np.ndindex(2, 2, 2):
        weight = np.where(offset, share, 1 - share).prod(1)
        result += (weight * values[:, *(corner + offset).T]).T
    return result
