"""The reference on every level: a template is split and fitted to it, again and again (section 3.1)."""

from __future__ import annotations

import numpy as np
import torch
from scipy.sparse import csr_array

from mitex.losses.chamfer import chamfer, sample_surface
from mitex.mesh import Mesh
from mitex.mesh.topology import edge_graph
from mitex.methods.geometric.config import GeometricConfig
from mitex.methods.geometric.connectivity import FaceGraph
from mitex.methods.geometric.hierarchy import mean_edge
from mitex.progress import announce
from mitex.sparse import csr_tensor
from mitex.training.optim import Adam

TO_REFERENCE, TO_TEMPLATE = 0.4, 0.6  # weights of the two distances
LAST = 0.1  # the learning rate at the end of a level, as a part of that at its beginning


def fit_level(
    reference: Mesh, vertices: torch.Tensor, graph: FaceGraph, level: int, config: GeometricConfig
) -> torch.Tensor:
    """Vertices (V, 3) of one level's training mesh.

    Args:
        reference: normalised as the template is; its size is doubled on every level.
        vertices: (V, 3) to start from: the template, or the mesh of the level before, split and doubled.
        graph: of their faces.
        level: which one this is.
        config: settings.
    """
    generator = torch.Generator().manual_seed(config.seed + level)
    target = torch.tensor(reference.vertices) * 2**level
    faces = torch.tensor(reference.faces).long()
    fitting = Fitting(graph, target, faces, config, config.fit_samples * (level + 1))
    return fitting.run(vertices, generator, f"fitting training mesh {level}")


class Fitting:
    """The optimization of one level.

    Args:
        graph: of the faces of the mesh that is fitted.
        target, target_faces: the reference, (V, 3) and (F, 3).
        config: settings.
        samples: points on each of the two in every step.
    """

    def __init__(
        self,
        graph: FaceGraph,
        target: torch.Tensor,
        target_faces: torch.Tensor,
        config: GeometricConfig,
        samples: int,
    ) -> None:
        self.graph, self.target, self.target_faces = graph, target, target_faces
        self.config, self.samples = config, samples
        self.ring = _ring(graph)

    def run(
        self, vertices: torch.Tensor, generator: torch.Generator, work: str = "fitting a mesh"
    ) -> torch.Tensor:
        """The vertices (V, 3), fitted; `work` is announced."""
        vertices = vertices.clone().requires_grad_()
        optimizer, config = Adam([vertices]), self.config
        unit = float(mean_edge(vertices.detach(), self.graph))
        for step in range(config.fit_steps):
            announce(work, step, config.fit_steps)
            optimizer.clear()
            (self.distance(vertices, generator) + self.regularity(vertices)).backward()
            optimizer.step(config.fit_lr * unit * LAST ** (step / config.fit_steps))
        return vertices.detach()

    def distance(self, vertices: torch.Tensor, generator: torch.Generator) -> torch.Tensor:
        """Weighted sum () of the distances of the two surfaces, in both directions, and of their normals.

        Args:
            vertices: (V, 3) of the training mesh.
            generator: of the points on both surfaces.
        """
        ours = sample_surface(vertices, self.graph.faces, self.samples, generator)
        theirs = sample_surface(self.target, self.target_faces, self.samples, generator)
        to, back, normals_to, normals_back = chamfer(ours, theirs)
        normals = self.config.fit_normals * (normals_to + normals_back)
        return TO_REFERENCE * to + TO_TEMPLATE * back + normals

    def regularity(self, vertices: torch.Tensor) -> torch.Tensor:
        """Weighted sum () that is small where edges are even and the surface, vertices (V, 3), is smooth."""
        corners = vertices[self.graph.faces]
        lengths = (corners.roll(-1, 1) - corners).norm(dim=2)
        share = (lengths / lengths.sum(1, keepdim=True)).clamp_min(1e-9)
        entropy = -(share * share.log()).sum(1).mean()
        smooth = (vertices - self.ring @ vertices).abs().mean()
        config = self.config
        return config.fit_uniform * lengths.std() - config.fit_entropy * entropy + config.fit_smooth * smooth


def _ring(graph: FaceGraph) -> torch.Tensor:
    """(V, V) sparse: the mean of each vertex's neighbours."""
    count = len(graph.incident)
    edges = edge_graph(graph.faces.numpy(), count)
    share = np.repeat(1.0 / np.maximum(edges.valence, 1), edges.valence)
    return csr_tensor(csr_array((share, edges.indices, edges.indptr), shape=(count, count)))
