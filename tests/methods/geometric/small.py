"""A bumpy reference, and a small task whose meshes need no fit."""

from dataclasses import replace

import numpy as np
import pytest
import torch

from mitex.mesh import Mesh, icosphere
from mitex.methods.geometric.config import GeometricConfig
from mitex.methods.geometric.hierarchy import Hierarchy
from mitex.methods.geometric.network import FaceNetwork
from mitex.methods.geometric.task import GeometricTask


def bumpy() -> Mesh:
    ball = icosphere(12)
    height = 1 + 0.15 * np.sin(7 * ball.vertices).prod(1, keepdims=True)
    return replace(ball.with_vertices(ball.vertices * height), name="bumpy")


def rough_reports(patch: pytest.MonkeyPatch) -> None:
    """How well training meshes fit is told of a few points."""
    patch.setattr("mitex.methods.geometric.report.SAMPLES", 1000)


def small_task(**changes) -> GeometricTask:
    config = replace(GeometricConfig(steps=9, level_steps=3), **changes)
    ball = icosphere(1)
    hierarchy = Hierarchy.of(ball, config.levels)
    generator = torch.Generator().manual_seed(4)
    meshes = [
        torch.tensor(mesh.vertices) * 2**k + 0.1 * torch.randn(len(mesh.vertices), 3, generator=generator)
        for k, mesh in enumerate(hierarchy.meshes)
    ]
    return GeometricTask(config, hierarchy, torch.tensor(ball.vertices), meshes, bumpy(), {})


def same_weights(one: FaceNetwork, other: FaceNetwork) -> bool:
    pairs = zip(one.parameters, other.parameters, strict=True)
    return all(p.shape == q.shape and torch.equal(p, q) for p, q in pairs)
