"""What the networks see of a mesh, and how they move it: coordinates in the frames of the faces' sides."""

from __future__ import annotations

import torch

from mitex.methods.geometric.connectivity import FaceGraph

CHANNELS = 4  # of each side
LEAST = 1e-12  # smaller squared lengths are raised to it, so that directions stay finite on degenerate faces


def side_frames(vertices: torch.Tensor, graph: FaceGraph) -> tuple[torch.Tensor, torch.Tensor]:
    """The frame of each side of each face (section 3.2).

    Args:
        vertices: (..., V, 3) positions.
        graph: of the F faces.

    Returns:
        (..., F, 3, 3, 3), for each side the unit vectors x along it, y outwards across it and z along the
        face's normal, as rows; and (..., F, 3) the sides' lengths.
    """
    corners = vertices[..., graph.faces, :]
    sides = corners.roll(-1, -2) - corners
    lengths = sides.square().sum(-1).clamp_min(LEAST).sqrt()
    x = sides / lengths[..., None]
    z = _unit(torch.linalg.cross(sides[..., 0, :], sides[..., 1, :]))[..., None, :].expand_as(x)
    y = torch.linalg.cross(x, z)
    return torch.stack([x, y, z], -2), lengths


def face_features(vertices: torch.Tensor, graph: FaceGraph) -> torch.Tensor:
    """The 12 features of a face that no rigid motion changes: 4 for each side (section 3.2).

    The neighbour's vertex off the side, seen from the side's middle in the side's frame, and the side's
    length; (0, 0.866, 0, 1) in a flat lattice of edge length 1. Across an open side the face is mirrored.

    Args:
        vertices: (..., V, 3) positions, in units of the mean edge length.
        graph: of the F faces.

    Returns:
        (..., F, 3, 4).
    """
    frames, lengths = side_frames(vertices, graph)
    corners = vertices[..., graph.faces, :]
    middles = 0.5 * (corners + corners.roll(-1, -2))
    apex = (frames @ (vertices[..., graph.opposite, :] - middles)[..., None]).squeeze(-1)
    mirrored = apex * apex.new_tensor([1.0, -1.0, 1.0])
    apex = torch.where(graph.open[..., None], mirrored, apex)
    return torch.cat([apex, lengths[..., None]], -1)


def displaced(vertices: torch.Tensor, graph: FaceGraph, offsets: torch.Tensor) -> torch.Tensor:
    """Vertices moved by the mean of what their faces ask for (section 3.2).

    Args:
        vertices: (..., V, 3) positions.
        graph: of the F faces.
        offsets: (..., F, 3), a vector for each face; corner k takes it in the frame of the side that begins
            there.

    Returns:
        (..., V, 3).
    """
    frames, _ = side_frames(vertices, graph)
    moves = (frames.mT @ offsets[..., None, :, None]).squeeze(-1)
    total = torch.zeros_like(vertices).index_add(-2, graph.faces.view(-1), moves.flatten(-3, -2))
    return vertices + total / graph.incident[:, None]


def _unit(vectors: torch.Tensor) -> torch.Tensor:
    return vectors / vectors.square().sum(-1, keepdim=True).clamp_min(LEAST).sqrt()
