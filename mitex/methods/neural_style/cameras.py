"""Where the trainings of neural style fields look at the mesh from."""

from __future__ import annotations

import math

import torch

from mitex.methods.neural_style.config import StyleConfig
from mitex.scenes.cameras import Cameras, random_views

FRONT = (90.0, 0.0)  # azimuth and elevation of the anchor [degrees]: +z
SPREAD = (90.0, 45.0)  # standard deviations around it [degrees]
STEEPEST = 80.0  # elevation [degrees]


def cameras_of(config: StyleConfig, generator: torch.Generator) -> Cameras:
    """The cameras of a step, uniformly around the mesh or, the first one at the front, around that."""
    if config.cameras == "around":
        return random_views(generator, config.views, config.distance, config.fov, config.view)
    noise = torch.randn(config.views, 2, generator=generator)
    noise[0] = 0
    angles = torch.tensor(FRONT) + noise * torch.tensor(SPREAD)
    azimuth, elevation = torch.deg2rad(angles[:, 0]), angles[:, 1].clamp(-STEEPEST, STEEPEST).deg2rad()
    ring = elevation.cos()
    origin = torch.stack([ring * azimuth.cos(), elevation.sin(), ring * azimuth.sin()], 1)
    places = (config.distance * origin).numpy()
    up = torch.tensor([0.0, 1.0, 0.0]).expand(config.views, 3).numpy()
    return Cameras(
        "perspective", places, 0 * places, up, fov=config.fov, width=config.view, height=config.view
    )


def frame_height(config: StyleConfig) -> float:
    """Of what a camera sees at the distance of the mesh's middle [radii]."""
    return 2 * config.distance * math.tan(0.5 * math.radians(config.fov))
