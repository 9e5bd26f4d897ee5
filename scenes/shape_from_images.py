"""Find the shape of a bumpy ball from eight pictures of it, by gradients through the renderer.

usage: python scenes/shape_from_images.py [OUT.png]

OUT.png shows the true shape, the ball that the search starts from, and what it found.
"""

import sys
from collections.abc import Callable

import numpy as np
import scipy.sparse
import scipy.sparse.linalg
import torch

from mitex.images import write_image
from mitex.mesh import Mesh, icosphere
from mitex.methods.geometric.portrait import portrait
from mitex.scenes.cameras import orbit
from mitex.scenes.geometry_renderer import GeometryRenderer
from mitex.training.optim import Adam

SMOOTHING = 20.0  # how far a vertex' gradient spreads over the surface


def smoother(mesh: Mesh) -> Callable[[np.ndarray], np.ndarray]:
    """Spreads gradients (V, 3), so that vertices move together (after Nicolet et al. 2021, section 3)."""
    edges = mesh.edges
    count = len(mesh.vertices)
    neighbours = scipy.sparse.csr_array(
        (np.ones(len(edges.indices)), edges.indices, edges.indptr), shape=(count, count)
    )
    laplacian = scipy.sparse.diags_array(edges.valence.astype(float)) - neighbours
    solve = scipy.sparse.linalg.factorized((scipy.sparse.eye_array(count) + SMOOTHING * laplacian).tocsc())
    return lambda gradient: np.stack([solve(gradient[:, k]) for k in range(3)], 1)


def main(
    out: str = "shape.png", steps: int = 60, resolution: int = 64, spp: int = 64, side: int = 384
) -> list[float]:
    """Returns the loss of each step; the shapes are shown in `side` x `side` pixels each."""
    ball = icosphere(16)
    bumps = 1 + 0.12 * np.sin(5 * ball.vertices).prod(1, keepdims=True)
    wanted = ball.with_vertices(ball.vertices * bumps)
    renderer = GeometryRenderer(ball, orbit(8, elevation=17, resolution=resolution))
    pictures = renderer.render(torch.tensor(wanted.vertices), seed=1)

    vertices = torch.tensor(ball.vertices).clone().requires_grad_()
    optimizer, spread, losses = Adam([vertices], shared=True), smoother(ball), []
    for step in range(steps):
        optimizer.clear()
        loss = (renderer.render(vertices, seed=100 * (step + 1)) - pictures).square().mean()
        loss.backward()
        assert vertices.grad is not None
        vertices.grad = torch.from_numpy(spread(vertices.grad.numpy())).float()
        optimizer.step(0.01 * 0.1 ** (step / steps))
        losses.append(loss.item())
    shown = (wanted.vertices, ball.vertices, vertices.detach().numpy())
    print(write_image(out, np.hstack([portrait(v, ball.faces, side, spp) for v in shown])))
    return losses


if __name__ == "__main__":
    main(sys.argv[1] if len(sys.argv) > 1 else "shape.png")
