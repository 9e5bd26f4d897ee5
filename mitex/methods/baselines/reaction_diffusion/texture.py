"""`ReactionDiffusionTexture`: a learned reaction, and what it grows on any mesh."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import torch

from mitex.asset import Asset
from mitex.errors import ConfigError
from mitex.geometry.triangles import interpolate
from mitex.mesh import Mesh, remesh
from mitex.mesh.nearest import surface_points
from mitex.methods.baselines.reaction_diffusion import METHOD
from mitex.methods.baselines.reaction_diffusion.laplacian import mesh_laplacian
from mitex.methods.baselines.reaction_diffusion.ranges import MOST_STEPS, STEPS
from mitex.methods.baselines.reaction_diffusion.reaction import BOUND, Reaction, colours
from mitex.methods.checks import in_range
from mitex.methods.layout import RESOLUTION, layout_side, with_layout
from mitex.methods.point_colours import with_colours
from mitex.progress import announce
from mitex.ranges import SCALES, SEEDS, TEXELS
from mitex.runtime import keep_freed_memory
from mitex.sparse import LinearMap
from mitex.training import model_file

PERIOD = 16  # steps after which states are held within their bounds
MOST_CELLS = 500_000


@dataclass(frozen=True, eq=False)
class ReactionDiffusionTexture:
    """Chemicals that react and diffuse.

    Attributes:
        reaction: the system.
        cells: along the exemplar's width.
        width: of the exemplar on a mesh [sides of a layout's square].
        about: how it was made.
    """

    reaction: Reaction
    cells: int
    width: float
    about: Mapping[str, Any] = field(default_factory=dict)

    @classmethod
    def load(cls, source: str | Path) -> ReactionDiffusionTexture:
        """Reads a run folder or a model file.

        Raises:
            CheckpointError: there is none, or it is damaged.
        """
        with model_file.opened(source, METHOD.name) as (tensors, about):
            inner, bias, outer = tensors["inner"], tensors["bias"], tensors["outer"]
            rates, cells, width = tensors["rates"], int(tensors["cells"]), float(tensors["width"])
            shapes = (len(bias), len(rates)), (len(rates), len(bias))
            if (inner.shape, outer.shape) != shapes or len(rates) < 3:
                raise ValueError("weights whose shapes do not fit")
            if not all(value.isfinite().all() for value in tensors.values()) or cells < 1 or not width > 0:
                raise ValueError("values that are not finite, or an exemplar without a size")
            reaction = Reaction({"inner": inner, "bias": bias, "outer": outer}, rates)
            return cls(reaction, cells, width, about)

    def save(self, path: str | Path) -> Path:
        """Writes the model file (safetensors).

        Raises:
            OutputError: the place is not writable.
        """
        sizes = {"cells": torch.tensor(self.cells), "width": torch.tensor(self.width, dtype=torch.float64)}
        tensors = {**self.reaction.tensors, "rates": self.reaction.rates, **sizes}
        return model_file.save(path, tensors, METHOD.name, self.about)

    def apply(
        self,
        mesh: Mesh,
        *,
        seed: int = 0,
        steps: int = STEPS,
        scale: float = 1.0,
        resolution: int = 512,
        keep_uvs: bool = False,
    ) -> Asset:
        """Lets the chemicals react and diffuse on a mesh.

        The cells are the vertices of an even mesh of the same shape, as many as the size of the pattern asks
        for: with the settings of the fit it is that of a surface texture.

        Args:
            mesh: any.
            seed: of the blobs that it starts from, 0 to 2^32 - 1: another one, another variant.
            steps: of time.
            scale: size of the pattern.
            resolution: side of the asset's albedo [texels], 16 to 8192.
            keep_uvs: use the mesh's own UVs.

        Returns:
            The mesh with an albedo texture, without seams.

        Raises:
            ConfigError: the seed or another number is out of range, or there would be too many cells.
            MeshError: PyMeshLab is missing or fails.
        """
        in_range("`seed`", seed, *SEEDS)
        in_range("`scale`", scale, *SCALES)
        in_range("`resolution`", resolution, *TEXELS)
        in_range("`steps`", steps, 0, MOST_STEPS)
        unwrapped = with_layout(mesh, RESOLUTION, keep_uvs)
        cells = even_cells(unwrapped, scale * self.width / self.cells)
        keep_freed_memory()
        announce("letting the chemicals react")
        at_cells = self.grown(cells, seed, steps)

        def at(points: np.ndarray) -> np.ndarray:
            face, barycentric = surface_points(cells, points)
            return interpolate(barycentric, at_cells[cells.faces[face]])

        return with_colours(unwrapped, resolution, at, mesh.name)

    @torch.no_grad()
    def grown(self, cells: Mesh, seed: int, steps: int) -> np.ndarray:
        """(V, 3) sRGB in [0, 1] at the vertices of a mesh after some steps of time."""
        laplacian = LinearMap(mesh_laplacian(cells))
        state = self.reaction.start(len(cells.vertices), laplacian, torch.Generator().manual_seed(seed))
        for done in range(0, steps, PERIOD):
            state = self.reaction.evolve(state, laplacian, min(PERIOD, steps - done)).clamp(-BOUND, BOUND)
        return colours(state).clamp(0, 1).numpy()


def even_cells(mesh: Mesh, width: float) -> Mesh:
    """A mesh of the same shape, each of whose cells is as large as a square of a side.

    Args:
        mesh: with UVs.
        width: of the square [sides of the layout's square, at the median of the faces].

    Raises:
        ConfigError: there would be too many, or the layout has no area.
    """
    count = mesh.face_areas.sum(dtype=np.float64) / (width * layout_side(mesh)) ** 2
    if count > MOST_CELLS:
        raise ConfigError(
            f"a pattern so small on '{mesh.name}' needs {count:,.0f} cells", "use a larger scale"
        )
    return remesh(mesh, max(round(count), 12))
