"""The losses of a level: Wasserstein with gradient penalty, and reconstruction (section 3.3)."""

from __future__ import annotations

import torch

from mitex.methods.geometric.connectivity import FaceGraph
from mitex.methods.geometric.features import displaced, face_features
from mitex.methods.geometric.hierarchy import mean_edge
from mitex.methods.geometric.network import FaceNetwork


def generate(
    generator: FaceNetwork,
    vertices: torch.Tensor,
    graph: FaceGraph,
    noise: torch.Tensor | float = 0.0,
    remeasure: bool = False,
) -> torch.Tensor:
    """One level's displacement of vertices (V, 3).

    Args:
        generator: of three outputs.
        vertices: in units of the mean edge length.
        graph: of their faces.
        noise: (V, 3) that the features are taken with; the displacement starts from the clean vertices.
        remeasure: divide by the mean edge first, and multiply by it afterwards.
    """
    unit = mean_edge(vertices, graph) if remeasure else vertices.new_ones(())
    clean = vertices / unit
    offsets = generator(face_features(clean + noise, graph), graph)
    return displaced(clean, graph, offsets) * unit


def critic_loss(
    critic: FaceNetwork,
    real: torch.Tensor,
    fake: torch.Tensor,
    graph: FaceGraph,
    mix: torch.Tensor,
    penalty: float,
) -> tuple[torch.Tensor, torch.Tensor]:
    """What the critic minimises, and the estimated distance of the two, which is a part of it.

    Args:
        critic: of one output; its score of a mesh is the mean over the faces.
        real, fake: (F, 3, 4 or 6) features of two meshes of one connectivity.
        graph: that connectivity.
        mix: scalar in [0, 1], where between the two the penalty is taken.
        penalty: its weight.

    Returns:
        The loss, and the score of the real mesh minus that of the fake one; scalars, the second without a
        graph.
    """
    scores = critic(torch.stack([real, fake]), graph).mean((1, 2))
    distance = scores[0] - scores[1]
    between = torch.lerp(real, fake, mix)
    return penalty * gradient_penalty(critic, between, graph) - distance, distance.detach()


def gradient_penalty(critic: FaceNetwork, features: torch.Tensor, graph: FaceGraph) -> torch.Tensor:
    """How far the gradient of the summed scores is from length 1 (Gulrajani et al. 2017, equation 3).

    The length is taken for each face over all its features, and its squared difference from 1 averaged.
    """
    features = features.detach().requires_grad_()
    (gradient,) = torch.autograd.grad(critic(features, graph).sum(), features, create_graph=True)
    length = (gradient.square().sum((1, 2)) + 1e-12).sqrt()
    return (length - 1).square().mean()


def adversarial_loss(critic: FaceNetwork, vertices: torch.Tensor, graph: FaceGraph) -> torch.Tensor:
    """What the generator minimises: the negative score () of its mesh, vertices (V, 3)."""
    return -critic(face_features(vertices, graph), graph).mean()
