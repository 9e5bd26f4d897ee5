"""Generators of successive levels, at work on one mesh."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
import torch

from mitex.geometry.vectors import dot
from mitex.mesh import Mesh
from mitex.methods.geometric.borders import REACH, with_borders
from mitex.methods.geometric.hierarchy import Hierarchy, mean_edge
from mitex.methods.geometric.model import grow
from mitex.methods.geometric.network import FaceNetwork
from mitex.methods.geometric.thickness import shallow
from mitex.progress import counted


@dataclass(frozen=True, eq=False)
class Rollout:
    """Generators of successive levels, to run on one mesh.

    Attributes:
        generators: of the levels.
        hierarchy: of the mesh, with as many levels.
        level: of the first generator.
        noise_scale: standard deviation of the noise [mean edges].
        remeasure: as in `mitex.methods.geometric.gan.generate`.
        thick: (V,) the thickness of the mesh, beside which dents stay shallow; None for any depth.
    """

    generators: Sequence[FaceNetwork]
    hierarchy: Hierarchy
    level: int
    noise_scale: float
    remeasure: bool
    thick: np.ndarray | None

    def noise(self, seed: int) -> list[torch.Tensor]:
        """Noise (V, 3) for each level."""
        rng = torch.Generator().manual_seed(seed)
        counts = [len(mesh.vertices) for mesh in self.hierarchy.meshes]
        return [self.noise_scale * torch.randn(count, 3, generator=rng) for count in counts]

    @torch.no_grad()
    def run(self, noises: Sequence[torch.Tensor], vertices: np.ndarray | None = None) -> Iterator[Mesh]:
        """The mesh after each level, in its own units and place; its borders, if any, have not moved.

        Args:
            noises: (V, 3) of each level [mean edges].
            vertices: (V, 3) to start from, in place of the mesh's own.
        """
        mesh, graph = self.hierarchy.meshes[0], self.hierarchy.graphs[0]
        centre = mesh.vertices.mean(0, dtype=np.float64)
        given = mesh.vertices if vertices is None else vertices
        centred, start = (torch.from_numpy((v - centre).astype(np.float32)) for v in (mesh.vertices, given))
        unit = float(mean_edge(centred, graph))
        steps, thick = grow(self.generators, self.hierarchy, start / unit, noises, self.remeasure), self.thick
        for level, grown in enumerate(counted("growing levels", steps, len(self.generators))):
            positions = grown.numpy().astype(np.float64) * (unit / 2**level) + centre
            before = self.hierarchy.meshes[level]
            after = before.with_vertices(positions)
            if thick is not None and level:
                thick = np.concatenate([thick, thick[self.hierarchy.pairs[level - 1].numpy()].mean(1)])
            after = after if thick is None else shallow(before, after, thick)
            yield with_borders(before, after, REACH * unit)


def slerp(a: torch.Tensor, b: torch.Tensor, t: float) -> torch.Tensor:
    """From a (t = 0) to b (t = 1) along the great circle through their directions (Shoemake 1985)."""
    norms = a.norm() * b.norm()
    angle = torch.arccos((a * b).sum().div(norms.clamp_min(1e-12)).clamp(-1, 1))
    if angle < 1e-4:
        return torch.lerp(a, b, t)
    return (torch.sin((1 - t) * angle) * a + torch.sin(t * angle) * b) / torch.sin(angle)


def between(mesh: Mesh, start: np.ndarray, stop: np.ndarray, t: float) -> np.ndarray:
    """From one relief of a mesh (t = 0) to another (t = 1); the spread of heights stays where theirs agree.

    Args:
        mesh: V vertices.
        start, stop: (V, 3) those, moved along their normals.
        t: from 0 to 1.
    """
    if t in (0.0, 1.0):
        return stop if t else start
    a, b = (
        torch.from_numpy(dot(end - mesh.vertices, mesh.normals.astype(np.float64))) for end in (start, stop)
    )
    heights = torch.lerp(a.mean(), b.mean(), t) + slerp(a - a.mean(), b - b.mean(), t)
    return mesh.vertices + heights.numpy()[:, None] * mesh.normals
