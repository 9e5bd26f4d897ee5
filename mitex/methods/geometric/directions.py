"""Which way a relief runs: a vector field on the vertices of every level, and what each face has of it.

The paper's features are blind to direction, which it names as its limit (Hertz et al. 2020, figure 12). Here
each vertex has a unit vector in space, zero where there is none. It stays as it is while the networks move
the surface; each face projects it onto itself (`mitex.methods.geometric.features`).
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch

from mitex.geometry.vectors import unit
from mitex.mesh import Mesh
from mitex.mesh.fields import carried_field


def level_fields(reference: Mesh, field: np.ndarray, meshes: Sequence[Mesh]) -> list[torch.Tensor]:
    """The field of a reference on meshes of nearly the same surface.

    Args:
        reference: V vertices.
        field: (V, 3) of its vertices.
        meshes: the training mesh of each level, in the reference's place and size.

    Returns:
        For each of them (V', 3) float32, unit vectors or zero.
    """
    return [_units(carried_field(reference, mesh, field)) for mesh in meshes]


def spread(field: np.ndarray, pairs: Sequence[torch.Tensor], symmetric: bool) -> list[torch.Tensor]:
    """A field of a mesh on this mesh and on what it is split into: halfway in the middle of each edge.

    Args:
        field: (V, 3).
        pairs: of a `Hierarchy`: for each level but the last, (E, 2) the ends of the edges.
        symmetric: whether a vector and its opposite are the same.

    Returns:
        For each level (V', 3) float32, unit vectors or zero.
    """
    fields = [_units(field)]
    for ends in pairs:
        middles = _mean(fields[-1][ends], symmetric)
        fields.append(torch.cat([fields[-1], middles]))
    return fields


def face_directions(field: torch.Tensor, faces: torch.Tensor, symmetric: bool) -> torch.Tensor:
    """(F, 3) the mean direction of the corners of faces (F, 3), of a field (V, 3); zero if they cancel."""
    return _mean(field[faces], symmetric)


def _mean(vectors: torch.Tensor, symmetric: bool) -> torch.Tensor:
    """(N, 3) unit vectors between vectors (N, K, 3); all are turned to the first one's side if symmetric."""
    if symmetric:
        ahead = (vectors * vectors[:, :1]).sum(-1, keepdim=True) >= 0
        vectors = torch.where(ahead, vectors, -vectors)
    return torch.nn.functional.normalize(vectors.sum(1), dim=1, eps=1e-6)


def _units(field: np.ndarray) -> torch.Tensor:
    return torch.from_numpy(unit(field.astype(np.float64)).astype(np.float32))
