"""How far two surfaces are from each other, by samples: Chamfer distance with normals."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
from scipy.spatial import KDTree

from mitex.runtime.workers import tree_threads


@dataclass(frozen=True, eq=False)
class Samples:
    """Points on a surface: positions (n, 3), and the unit normals there, (n, 3)."""

    points: torch.Tensor
    normals: torch.Tensor


def sample_surface(
    vertices: torch.Tensor, faces: torch.Tensor, count: int, generator: torch.Generator
) -> Samples:
    """Random points, uniform by area, differentiable in the vertices.

    Args:
        vertices: (V, 3) float32.
        faces: (F, 3) int64.
        count: number of points.
        generator: source of all randomness.

    Raises:
        RuntimeError: no face has an area.
    """
    a, b, c = (vertices[faces[:, k]] for k in range(3))
    crosses = torch.linalg.cross(b - a, c - a)
    areas = crosses.detach().norm(dim=1).double().cumsum(0)
    position = torch.rand(count, generator=generator, dtype=torch.float64) * areas[-1]
    index = torch.searchsorted(areas, position).clamp_max(len(faces) - 1)
    root, v = torch.rand(2, count, generator=generator)
    root = root.sqrt()[:, None]
    v = v[:, None]
    points = (1 - root) * a[index] + root * (1 - v) * b[index] + root * v * c[index]
    return Samples(points, torch.nn.functional.normalize(crosses[index], dim=1))


def chamfer(ours: Samples, theirs: Samples) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]:
    """Mean distances and mean normal differences between each sample and its nearest on the other surface.

    Returns:
        Distance from ours to theirs, distance from theirs to ours (not squared), and 1 - cos of the angles
        between the normals, in both directions; scalars, differentiable in `ours` and `theirs`.
    """
    return matched(ours, theirs, nearest(ours.points, theirs.points), nearest(theirs.points, ours.points))


def matched(
    ours: Samples, theirs: Samples, to: torch.Tensor, back: torch.Tensor
) -> tuple[torch.Tensor, torch.Tensor, torch.Tensor, torch.Tensor]:
    """What `chamfer` returns; `to` has the nearest sample of each of ours, `back` of each of theirs."""
    return (
        (ours.points - theirs.points[to]).norm(dim=1).mean(),
        (theirs.points - ours.points[back]).norm(dim=1).mean(),
        1 - (ours.normals * theirs.normals[to]).sum(1).mean(),
        1 - (theirs.normals * ours.normals[back]).sum(1).mean(),
    )


def nearest(points: torch.Tensor, others: torch.Tensor) -> torch.Tensor:
    """For each point the index of the nearest of the others."""
    # Unbalanced trees are built three times as fast, and random samples do not need balance.
    tree = KDTree(others.detach().numpy(), balanced_tree=False, compact_nodes=False)
    _, index = tree.query(points.detach().numpy(), workers=tree_threads(len(points)))
    return torch.from_numpy(np.asarray(index))
