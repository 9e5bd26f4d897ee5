"""Textures move, and turn with their field: a still one that is carried, and one that learns it in training,
which is small, but real and to the end.
"""

import math

import numpy as np
import pytest
import torch

from mitex.exemplar import Exemplar
from mitex.features.flow import lucas_kanade
from mitex.methods import nca
from mitex.methods.nca import NcaTexture, settling
from mitex.methods.nca.motion.cell_motion import period, tile_motion
from mitex.methods.nca.surfaces import TrainingPlane, Windows

CELLS, PIXELS, STEPS = 32, 128, 4  # of a window, and between two pictures
# Fast motion is learned in fewer steps than that of the preset.
SETTINGS = (
    *("motion_advection=false", "motion_period=8", "motion_steps=8", "motion_speeds=0.5,1.5"),
    *("motion_weight=2", "lr=1e-3"),
    *(
        "steps=260",
        "pool=16",
        "inject_every=6",
        "surfaces=flat",
        "view_count=2",
        "exemplar_size=128",
        "zooms=1",
    ),
    *("milestones=180,230", "preview_every=0"),
)


@torch.no_grad()
def _velocity(texture: NcaTexture, angle: float) -> np.ndarray:
    """Mean motion along x and y (up) in a flat square [edges per period], by Lucas and Kanade's method."""
    look, generator = texture.look, torch.Generator().manual_seed(0)
    plane = TrainingPlane.of(64, look)
    field = f"{math.cos(angle)},{math.sin(angle)},0"
    motion = tile_motion(look, texture.about, plane.lattice, field, 1.0)
    moved = motion.condition, motion.advection
    state = look.evolve(look.rule.seed(plane.perception), plane.perception, 150, generator, *moved)
    windows, grey, flows = Windows(np.full((1, 2), 0.2), CELLS / 64, PIXELS, 2), [], []
    for _ in range(6):
        picture = plane.windows(look, state[0], windows)[..., list(look.layout["albedo"])]
        grey.append(picture.mean(3)[:, None])
        state = look.evolve(state, plane.perception, STEPS, generator, *moved)
    for first, second in zip(grey, grey[1:], strict=False):
        flows.append(lucas_kanade(first, second)[0, :, 16:-16, 16:-16].mean((1, 2)).numpy())
    scale = CELLS / PIXELS * period(texture.about) / STEPS
    return np.median(flows, axis=0) * (scale, -scale)


def test_a_shipped_texture_is_carried():
    """As fast as the field says, and where it says; it was not trained to."""
    texture = NcaTexture.load("ceramic")
    for angle in (0.4, 0.4 + math.pi / 2):
        velocity = _velocity(texture, angle)
        assert math.degrees(math.atan2(velocity[1], velocity[0]) - angle) == pytest.approx(0, abs=15)
        assert 0.7 < np.hypot(*velocity) < 1.2


@pytest.mark.slow
@pytest.mark.parametrize("estimator", ["advection", "flow"])
def test_a_turned_field_turns_the_motion(monkeypatch, estimator):
    monkeypatch.setattr(settling, "STEPS", (1,))
    settings = (*SETTINGS, f"motion_estimator={estimator}")
    texture = nca.fit(Exemplar.load("lava"), init="lava", motion="right", set=settings)
    velocities = [_velocity(texture, angle) for angle in (0.4, 0.4 + math.pi / 2)]
    angles = [math.atan2(y, x) for x, y in velocities]
    turn = math.degrees(angles[1] - angles[0]) % 360
    assert turn == pytest.approx(90, abs=15)
    assert math.degrees(angles[0] - 0.4) == pytest.approx(0, abs=25)
    assert all(0.6 < np.hypot(*velocity) < 1.4 for velocity in velocities)
