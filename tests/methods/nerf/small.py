"""A small texture with random parameters, made without a fit."""

from __future__ import annotations

import numpy as np
import torch

from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf import NerfTexture
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.base.coarse import BaseShape
from mitex.methods.nerf.config import NerfConfig
from mitex.methods.nerf.field.encoding import Encoding
from mitex.methods.nerf.field.mlp import weight_bound
from mitex.methods.nerf.field.networks import weight_shapes
from mitex.methods.nerf.files import SETTINGS, Model
from mitex.methods.nerf.synthesis.maps import CHANNELS, LatentMaps
from mitex.runtime import init

THICKNESS = 0.1


def small_texture(seed: int = 0) -> NerfTexture:
    """On a ball of radius 0.6, all of whose shell is occupied."""
    init()
    config = NerfConfig(table=10, coarsest=4, finest=8, ray_steps=64, occupancy=16, density_width=16)
    generator = torch.Generator().manual_seed(seed)

    def uniform(shape, bound: float) -> torch.Tensor:
        return torch.empty(shape).uniform_(-bound, bound, generator=generator)

    ball = icosphere(6)
    mesh = Mesh(0.6 * ball.vertices, ball.faces, name="ball")
    light = torch.cat([torch.tensor([4.0]), uniform(15, 0.3)])
    about = {key: getattr(config, key) for key in SETTINGS}
    about |= {"name": "small", "steps": 0, "centre": [0.0, 0.0, 0.0], "scale": 1.0}
    return NerfTexture(
        Model(
            BaseShape(mesh, 0.58 * ball.vertices, THICKNESS),
            face_frames(mesh),
            [uniform(size, 1.0) for size in Encoding(config).sizes],
            [2 * uniform(shape, weight_bound(shape)) for shape in weight_shapes(config)],
            light,
            np.ones((config.occupancy,) * 3, np.uint8),
            about,
        )
    )


def small_maps(height: int = 16, width: int = 16, seed: int = 0, gap: float = 0.05) -> LatentMaps:
    """Random features, smooth enough to be sampled."""
    rng = np.random.default_rng(seed)
    features = rng.uniform(-1, 1, (height, width, CHANNELS)).astype(np.float32)
    turns = np.linalg.qr(rng.normal(size=(3, 3, 3)))[0].astype(np.float32)
    return LatentMaps(features, rng.integers(0, 3, (height, width)).astype(np.int32), turns, gap)
