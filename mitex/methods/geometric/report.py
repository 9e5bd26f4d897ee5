"""How well a training mesh follows the reference, and whether it is a sound surface."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch

from mitex.losses.chamfer import Samples, matched, nearest, sample_surface
from mitex.mesh import Mesh
from mitex.mesh.self_intersections import piercing_pairs

SAMPLES = 30_000


@dataclass(frozen=True)
class FitReport:
    """Numbers of one level; distances as parts of half the reference's largest extent.

    Attributes:
        faces: of the training mesh.
        chamfer: mean distance to the nearest point of the other surface, mean of both directions.
        hausdorff: largest of these distances.
        normals: mean angle between the normals there [degrees].
        flipped: faces whose normal is more than a right angle away from that of the nearest point.
        piercing: pairs of faces that pierce each other.
    """

    faces: int
    chamfer: float
    hausdorff: float
    normals: float
    flipped: int
    piercing: int

    def __str__(self) -> str:
        return (
            f"{self.faces:,} faces, distance {self.chamfer:.4f} (largest {self.hausdorff:.3f}), normals off "
            f"by {self.normals:.0f} degrees, {self.flipped} flipped faces, {self.piercing} piercing pairs"
        )


def report(mesh: Mesh, reference: Mesh, seed: int = 0) -> FitReport:
    """Compares a training mesh with the reference in the same place."""
    generator = torch.Generator().manual_seed(seed)
    ours, theirs = _samples(mesh, generator), _samples(reference, generator)
    extent = float((reference.vertices.max(0) - reference.vertices.min(0)).max()) / 2
    there, here = nearest(ours.points, theirs.points), nearest(theirs.points, ours.points)
    to, back, cos_to, cos_back = (float(x) for x in matched(ours, theirs, there, here))
    far = max(_largest(ours.points, theirs.points[there]), _largest(theirs.points, ours.points[here]))
    centres = torch.from_numpy(mesh.vertices[mesh.faces].mean(1))
    normals = theirs.normals[nearest(centres, theirs.points)].numpy()
    return FitReport(
        faces=len(mesh.faces),
        chamfer=(to + back) / 2 / extent,
        hausdorff=far / extent,
        normals=float(np.degrees(np.arccos(np.clip(1 - (cos_to + cos_back) / 2, -1, 1)))),
        flipped=int(((mesh.face_normals * normals).sum(1) < 0).sum()),
        piercing=len(piercing_pairs(mesh)),
    )


def _largest(points: torch.Tensor, others: torch.Tensor) -> float:
    """Distance of two points (n, 3) and (n, 3) that belong together."""
    return float((points.double() - others.double()).norm(dim=1).max())


def _samples(mesh: Mesh, generator: torch.Generator) -> Samples:
    faces = torch.tensor(mesh.faces).long()
    return sample_surface(torch.tensor(mesh.vertices), faces, SAMPLES, generator)
