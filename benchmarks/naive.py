"""The ordinary ways to compute what Mitex computes fast: plain torch under autograd, in float32 or float64.

Tests use them as references, benchmarks as what a ratio refers to.
"""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import torch
import torch.nn.functional as F
from safetensors.torch import load_file

from mitex.features import weights
from mitex.mesh import Mesh
from mitex.methods.geometric.connectivity import FaceGraph
from mitex.methods.geometric.network import FaceNetwork
from mitex.methods.nca import MeshNCA
from mitex.methods.nca.perception import harmonics
from mitex.scenes.stage import Visibility

CONVOLUTIONS = (2, 2, 3, 3, 3)  # of the blocks of VGG-16
MEAN = (123.68, 116.779, 103.939)


@dataclass(frozen=True)
class MessagePassing:
    """The MeshNCA step with a message along every edge.

    Attributes:
        receivers, neighbours: (E,) of each directed edge.
        weights: (E, h) harmonics of its direction.
    """

    receivers: torch.Tensor
    neighbours: torch.Tensor
    weights: torch.Tensor

    @staticmethod
    def of(mesh: Mesh, degree: int = 1, dtype: torch.dtype = torch.float32) -> MessagePassing:
        receivers, neighbours = mesh.edges.rows, mesh.edges.indices
        points = mesh.vertices.astype(np.float64)
        offsets = points[neighbours] - points[receivers]
        directions = offsets / (np.linalg.norm(offsets, axis=1, keepdims=True) + 1e-8)
        values = torch.from_numpy(harmonics(directions, degree)).to(dtype)
        return MessagePassing(torch.tensor(receivers), torch.tensor(neighbours), values)

    def perceive(self, state: torch.Tensor) -> torch.Tensor:
        """State (B, V, C) -> (B, V, (h + 1) C)."""
        batch, vertices, channels = state.shape
        difference = state[:, self.neighbours] - state[:, self.receivers]
        messages = self.weights[None, :, :, None] * difference[:, :, None, :]
        summed = state.new_zeros(batch, vertices, self.weights.shape[1], channels)
        summed = summed.index_add(1, self.receivers, messages)
        return torch.cat([summed.flatten(2), state], 2)

    def step(
        self,
        model: MeshNCA,
        state: torch.Tensor,
        mask: torch.Tensor | None = None,
        condition: torch.Tensor | None = None,
    ) -> torch.Tensor:
        """What `MeshNCA.step` computes."""
        inputs = self.perceive(state)
        if condition is not None:
            inputs = torch.cat([inputs, condition.expand(*state.shape[:2], -1)], 2)
        change = model.fc2(torch.relu(model.fc1(inputs)))
        return state + change if mask is None else state + change * mask[..., None]


def vgg_weights() -> dict[str, torch.Tensor]:
    """The tensors of VGG-16, float32."""
    return {name: tensor.float() for name, tensor in load_file(weights.vgg16_path()).items()}


def vgg(
    images: torch.Tensor,
    tensors: dict[str, torch.Tensor],
    pool: str = "average",
    scale: dict[str, float] | None = None,
) -> dict[str, torch.Tensor]:
    """All 13 layers of VGG-16 (K, h, w, C) of images (K, H, W, 3) in [0, 1]; `scale` divides layers."""
    x = images.permute(0, 3, 1, 2) * 255 - torch.tensor(MEAN).view(3, 1, 1)
    layers = {}
    for block, count in enumerate(CONVOLUTIONS, start=1):
        if block > 1:
            x = F.avg_pool2d(x, 2) if pool == "average" else F.max_pool2d(x, 2)
        for i in range(1, count + 1):
            key, name = f"conv{block}_{i}", f"relu{block}_{i}"
            x = torch.relu(F.conv2d(x, tensors[f"{key}.weight"], tensors[f"{key}.bias"], padding=1))
            layers[name] = x.permute(0, 2, 3, 1) / (1.0 if scale is None else scale[name])
    return layers


def vectors(maps: dict[str, torch.Tensor], positions: dict[str, torch.Tensor]) -> dict[str, torch.Tensor]:
    """Feature vectors (K, n, C) of whole maps (K, h, w, C) at `positions` (K, n)."""
    return {
        name: maps[name].flatten(1, 2).gather(1, where[:, :, None].expand(-1, -1, maps[name].shape[3]))
        for name, where in positions.items()
    }


def lookup(field: torch.Tensor, visibility: Visibility) -> torch.Tensor:
    """Images (K, H, W, C) of a field (V, C): three vertices are gathered for each pixel."""
    values = (field[visibility.vertex_index] * visibility.weight[..., None]).sum(1)
    flat = field.new_zeros(visibility.coverage.numel(), field.shape[1])
    return flat.index_copy(0, visibility.pixel, values).view(*visibility.shape, -1)


def relaxed_transport(a: torch.Tensor, b: torch.Tensor, euclidean: bool = False) -> torch.Tensor:
    """Equation 4 through the whole matrix of costs, under autograd."""
    cost = 1 - F.normalize(a, dim=-1) @ F.normalize(b, dim=-1).mT
    if euclidean:
        cost = cost + torch.cdist(a, b).square().clamp(1e-5, 1e5) / a.shape[-1]
    return torch.maximum(cost.amin(2).mean(1), cost.amin(1).mean(1))


def moment_distance(a: torch.Tensor, b: torch.Tensor) -> torch.Tensor:
    """Equation 5 under autograd."""

    def covariance(x: torch.Tensor) -> torch.Tensor:
        centred = x - x.mean(1, keepdim=True)
        return centred.mT @ centred / (x.shape[1] - 1)

    means = (a.mean(1) - b.mean(1)).abs().mean(1)
    return means + (covariance(a) - covariance(b)).abs().mean((1, 2))


def face_network(net: FaceNetwork, features: torch.Tensor, graph: FaceGraph) -> torch.Tensor:
    """The network of Hertz et al. as the paper writes it: [neighbour, self] for each neighbour, the largest.

    Features (..., F, 3, 4 or 6) to (..., F, outputs); the last two, if there are any, stand by the neighbour.
    """
    side, *layers, bias = net.parameters
    guides = features[..., 4:]
    x = torch.stack([features[..., k, :] @ side for k in range(3)]).amax(0)
    for across, own in zip(layers[::2], layers[1::2], strict=True):
        x = (x - x.mean(-2, keepdim=True)) / (x.var(-2, correction=0, keepdim=True) + 1e-5).sqrt()
        x = F.leaky_relu(x, 0.2)
        weight = torch.cat([across, own])
        pairs = [
            torch.cat([x[..., graph.neighbours[:, k], :], guides[..., k, :], x], -1) @ weight
            for k in range(3)
        ]
        x = torch.stack(pairs).amax(0)
    return x + bias
