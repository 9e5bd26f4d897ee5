"""Which faces meet along which sides: a face's convolutional neighbourhood (Hertz et al. 2020, figure 3)."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch

from mitex.errors import MeshError
from mitex.mesh import Mesh
from mitex.mesh.topology import face_edges


@dataclass(frozen=True, eq=False)
class FaceGraph:
    """The three neighbours of every face. Side k goes from corner k to corner k + 1.

    A side is open if it is no one else's, that of more than two faces, or run through in the same direction
    by the other face (the windings disagree). Across an open side lies the mirror image of the face itself.

    Attributes:
        faces: (F, 3) int64 vertex indices.
        neighbours: (F, 3) int64, the face across each side; the face itself across open ones.
        opposite: (F, 3) int64, that face's vertex off the side; the own one across open ones.
        open: (F, 3) bool.
        incident: (V,) float32, number of faces around each vertex, at least 1.
        directions: (F, 3) float32, which way the relief runs on each face, in space; None if it has no
            direction. See `mitex.methods.geometric.directions`.
        symmetric: whether a direction and its opposite are the same.
    """

    faces: torch.Tensor
    neighbours: torch.Tensor
    opposite: torch.Tensor
    open: torch.Tensor
    incident: torch.Tensor
    directions: torch.Tensor | None = None
    symmetric: bool = False

    @staticmethod
    def of(faces: np.ndarray, vertices: int) -> FaceGraph:
        """The graph of faces (F, 3) without repeated vertices, of which there are `vertices`."""
        faces = faces.astype(np.int64)
        across = _across(faces, vertices)
        closed = across >= 0
        own = np.arange(faces.size).reshape(-1, 3)
        partner = np.where(closed, across, own)
        neighbours = partner // 3
        opposite = faces[neighbours, (partner + 2 - 3 * neighbours) % 3]
        incident = np.maximum(np.bincount(faces.ravel(), minlength=vertices), 1).astype(np.float32)
        neighbours, opposite, open_ = (torch.tensor(a) for a in (neighbours, opposite, ~closed))
        return FaceGraph(torch.tensor(faces), neighbours, opposite, open_, torch.tensor(incident))

    def __len__(self) -> int:
        return len(self.faces)

    def to(self, device: torch.device | str) -> FaceGraph:
        """The same on another device."""
        tensors = {name: value.to(device) for name, value in vars(self).items() if torch.is_tensor(value)}
        return replace(self, **tensors)


def check_corners(mesh: Mesh) -> None:
    """Sides have neighbours only if they have two ends.

    Raises:
        MeshError: a face names a vertex twice; `Mesh.load` drops such faces.
    """
    twice = int((mesh.faces == np.roll(mesh.faces, 1, axis=1)).any(axis=1).sum())
    if twice:
        raise MeshError(f"{mesh.name} has faces that name a vertex twice: {twice:,}", "leave them out")


def _across(faces: np.ndarray, vertices: int) -> np.ndarray:
    """(F, 3) the side 3 f + k that meets each side in the opposite direction; -1 across open ones."""
    pairs, edges = face_edges(faces, vertices)
    edge = edges.ravel()
    ahead = (faces < np.roll(faces, -1, axis=1)).ravel()
    total = np.bincount(edge, minlength=len(pairs))
    forward = np.bincount(edge, weights=ahead, minlength=len(pairs))
    meets = (total == 2) & (forward == 1)
    side = np.arange(faces.size)
    of_edge = np.full((len(pairs), 2), -1)
    of_edge[edge, ahead.astype(int)] = side
    return np.where(meets[edge], of_edge[edge, 1 - ahead.astype(int)], -1).reshape(-1, 3)
