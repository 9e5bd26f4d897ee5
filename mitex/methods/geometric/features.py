"""What the networks see of a mesh, and how they move it: coordinates in the frames of the faces' sides."""

from __future__ import annotations

import torch

from mitex.methods.geometric.connectivity import FaceGraph

CHANNELS = 4  # of each side
GUIDES = 2  # further ones, where the relief has a direction
LEAST = 1e-12  # smaller squared lengths are raised to it, so that directions stay finite on degenerate faces
FAINT = 0.1  # sine between a direction and a face's normal, below which the direction fades on the face


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
    """The features of a face that no rigid motion changes: 4 for each side (section 3.2), 6 with directions.

    The neighbour's vertex off the side, seen from the side's middle in the side's frame, and the side's
    length; (0, 0.866, 0, 1) in a flat lattice of edge length 1. Across an open side the face is mirrored.
    Then, if the graph has directions, those of `side_directions`.

    Args:
        vertices: (..., V, 3) positions, in units of the mean edge length.
        graph: of the F faces.

    Returns:
        (..., F, 3, 4 or 6).
    """
    frames, lengths = side_frames(vertices, graph)
    corners = vertices[..., graph.faces, :]
    middles = 0.5 * (corners + corners.roll(-1, -2))
    apex = (frames @ (vertices[..., graph.opposite, :] - middles)[..., None]).squeeze(-1)
    mirrored = apex * apex.new_tensor([1.0, -1.0, 1.0])
    apex = torch.where(graph.open[..., None], mirrored, apex)
    features = torch.cat([apex, lengths[..., None]], -1)
    if graph.directions is None:
        return features
    return torch.cat([features, side_directions(frames, graph.directions, graph.symmetric)], -1)


def side_directions(frames: torch.Tensor, directions: torch.Tensor, symmetric: bool) -> torch.Tensor:
    """Directions as the sides see them: (cos a, sin a) of the angle a from the side's x to its y.

    (cos 2a, sin 2a) if a direction and its opposite are the same. Smaller on faces that the direction is
    nearly normal to, and 0 without one.

    Args:
        frames: (..., F, 3, 3, 3) of `side_frames`.
        directions: (F, 3) unit vectors, or zero.
        symmetric: see above.

    Returns:
        (..., F, 3, 2).
    """
    seen = (frames[..., :2, :] @ directions[:, None, :, None]).squeeze(-1)
    cos, sin = (seen / _at_least(seen, FAINT)).unbind(-1)
    doubled = (cos * cos - sin * sin, 2 * cos * sin)
    return torch.stack(doubled if symmetric else (cos, sin), -1)


def displaced(vertices: torch.Tensor, graph: FaceGraph, offsets: torch.Tensor) -> torch.Tensor:
    """Vertices moved by the mean of what their faces ask for (section 3.2).

    Args:
        vertices: (..., V, 3) positions.
        graph: of the F faces.
        offsets: (..., F, 3), a vector for each face; corner k takes it in its `corner_frames`.

    Returns:
        (..., V, 3).
    """
    frames = corner_frames(vertices, graph)
    moves = (frames.mT @ offsets[..., None, :, None]).squeeze(-1)
    total = torch.zeros_like(vertices).index_add(-2, graph.faces.view(-1), moves.flatten(-3, -2))
    return vertices + total / graph.incident[:, None]


def corner_frames(vertices: torch.Tensor, graph: FaceGraph) -> torch.Tensor:
    """What the three numbers of a face's offset mean at each of its corners.

    Without directions, the frame of the side that begins there. With them, the same for all corners: along
    the direction, across it, and along the normal. If a direction and its opposite are the same, the first
    two stretch the face along the direction and across it, which no sign changes.

    Args:
        vertices: (..., V, 3) positions.
        graph: of the F faces.

    Returns:
        (..., F, 3, 3, 3), three vectors for each corner, as rows.
    """
    frames, _ = side_frames(vertices, graph)
    if graph.directions is None:
        return frames
    z = frames[..., 2, :]
    directions = graph.directions[:, None, :]
    x = directions - (directions * z).sum(-1, keepdim=True) * z
    x = x / _at_least(x, FAINT)
    y = torch.linalg.cross(z, x)
    if graph.symmetric:
        corners = vertices[..., graph.faces, :]
        reach = corners - corners.mean(-2, keepdim=True)
        x, y = (axis * (axis * reach).sum(-1, keepdim=True) for axis in (x, y))
    return torch.stack([x, y, z], -2)


def _unit(vectors: torch.Tensor) -> torch.Tensor:
    return vectors / _at_least(vectors, LEAST**0.5)


def _at_least(vectors: torch.Tensor, least: float) -> torch.Tensor:
    """(..., 1) lengths of vectors (..., C), or `least` where they are shorter."""
    return vectors.square().sum(-1, keepdim=True).clamp_min(least**2).sqrt()
