"""A real training, small but to the end: the texture moves, and turns with its field."""

import math

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.features.flow import lucas_kanade
from mitex.methods import nca
from mitex.methods.nca import NcaTexture, settling
from mitex.methods.nca.surfaces import TrainingPlane, Windows

CELLS, PIXELS, STEPS = 32, 128, 4  # of a window, and between two pictures
# Fast motion is learned in fewer steps than that of the preset.
SETTINGS = (
    *("motion_period=8", "motion_steps=8", "motion_speeds=0.5,1.5"),
    *("steps=170", "pool=8", "surfaces=flat", "view_count=2", "exemplar_size=128", "zooms=1"),
    *("milestones=120,150", "preview_every=0"),
)


@torch.no_grad()
def _velocity(texture: NcaTexture, angle: float) -> np.ndarray:
    """Mean motion along x and y (up) in a flat square [edges per period], by Lucas and Kanade's method."""
    look, generator = texture.look, torch.Generator().manual_seed(0)
    plane = TrainingPlane.of(64, look)
    told = torch.tensor([math.cos(angle), math.sin(angle), 0.0]).expand(plane.perception.vertices, 3)
    state = look.evolve(look.rule.seed(plane.perception), plane.perception, 150, generator, told)
    windows, grey, flows = Windows(np.full((1, 2), 0.2), CELLS / 64, PIXELS, 2), [], []
    for _ in range(6):
        picture = plane.windows(look, state[0], windows)[..., list(look.layout["albedo"])]
        grey.append(picture.mean(3)[:, None])
        state = look.evolve(state, plane.perception, STEPS, generator, told)
    for first, second in zip(grey, grey[1:], strict=False):
        flows.append(lucas_kanade(first, second)[0, :, 16:-16, 16:-16].mean((1, 2)).numpy())
    scale = CELLS / PIXELS * float(texture.about["motion_period"]) / STEPS
    return np.median(flows, axis=0) * (scale, -scale)


@pytest.mark.slow
def test_a_turned_field_turns_the_motion(monkeypatch):
    monkeypatch.setattr(settling, "STEPS", (1,))
    texture = nca.fit(Exemplar.load("lava"), init="lava", motion="right", set=SETTINGS)
    velocities = [_velocity(texture, angle) for angle in (0.4, 0.4 + math.pi / 2)]
    angles = [math.atan2(y, x) for x, y in velocities]
    turn = math.degrees(angles[1] - angles[0]) % 360
    assert turn == pytest.approx(90, abs=15)
    assert math.degrees(angles[0] - 0.4) == pytest.approx(0, abs=25)
    assert all(0.6 < np.hypot(*velocity) < 1.4 for velocity in velocities)
