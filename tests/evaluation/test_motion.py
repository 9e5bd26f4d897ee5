"""Motion measured in films whose motion is known."""

import numpy as np
import pytest
import torch

from mitex.errors import ConfigError, ImageError
from mitex.evaluation.motion import measured_motion, motion_errors
from tests.features.flow.synthetic import pair, places, shift, texture

SIDE = 64
MASK = np.zeros((SIDE, SIDE))
MASK[8:-8, 8:-8] = 1


def coloured(grey: torch.Tensor) -> np.ndarray:
    """(N, H, W, 3) frames of grey ones (N, H, W)."""
    return grey[..., None].expand(*grey.shape, 3).numpy()


def constant(x: float, y: float) -> np.ndarray:
    return np.broadcast_to(np.array([x, y], np.float32), (SIDE, SIDE, 2))


FRAMES = coloured(pair(shift(0.9, 0.6))[0])


def test_a_texture_that_moves_as_it_should():
    errors = measured_motion(FRAMES, constant(3.0, 2.0), MASK, steps=3, period=10)
    assert errors.direction < 1 and errors.end_point < 0.02
    assert errors.speed_ratio == pytest.approx(1, abs=0.02) and errors.speed_spread < 0.03


@pytest.mark.parametrize("degrees", [90, 180, -30])
def test_a_turned_target(degrees):
    angle = np.deg2rad(degrees)
    x, y = 0.9 * np.cos(angle) - 0.6 * np.sin(angle), 0.9 * np.sin(angle) + 0.6 * np.cos(angle)
    errors = measured_motion(FRAMES, constant(x, y), MASK, steps=1, period=1)
    assert errors.direction == pytest.approx(abs(degrees), abs=1)
    assert errors.speed_ratio == pytest.approx(1, abs=0.02)


def test_the_flow_network_as_the_judge(monkeypatch):
    """It agrees with Lucas and Kanade's method, which it does without."""
    by_default = measured_motion(FRAMES, constant(3.0, 2.0), MASK, steps=3, period=10)
    monkeypatch.setattr("mitex.features.flow.estimator.lucas_kanade", None)
    errors = measured_motion(FRAMES, constant(3.0, 2.0), MASK, steps=3, period=10, judge="flow")
    assert errors.direction < 5 and 0.85 < errors.speed_ratio < 1.15
    assert errors.direction != by_default.direction


def test_a_texture_that_is_too_fast():
    errors = measured_motion(FRAMES, constant(0.6, 0.4), MASK, steps=1, period=1)
    assert errors.direction < 1 and errors.speed_ratio == pytest.approx(1.5, abs=0.03)
    assert errors.end_point == pytest.approx(np.hypot(0.3, 0.2), abs=0.02)


def test_a_longer_film_of_a_rotation():
    x, y = places(SIDE, SIDE)
    film = []
    for angle in (0.0, 0.05, 0.1):
        turned = np.cos(angle) * x + np.sin(angle) * y, np.cos(angle) * y - np.sin(angle) * x
        film.append(texture(*turned))
    target = 0.05 * torch.stack([-y, x], 2)
    errors = measured_motion(coloured(torch.stack(film)), target.numpy(), MASK, steps=1, period=1)
    assert errors.direction < 4 and errors.speed_ratio == pytest.approx(1, abs=0.03)


def test_plain_places_do_not_count():
    frames = []
    for x, y in (places(SIDE, SIDE)[0] + 0.9, places(SIDE, SIDE)[1] + 0.6), places(SIDE, SIDE):
        frames.append(0.5 + (texture(x, y) - 0.5) * torch.sigmoid(x))  # plain on the left
    errors = measured_motion(coloured(torch.stack(frames)), constant(0.9, 0.6), MASK, steps=1, period=1)
    assert errors.direction < 3 and errors.speed_ratio == pytest.approx(1, abs=0.05)


def test_silhouettes_and_places_that_stand_still_do_not_count():
    x, y = places(SIDE, SIDE)
    background, target = (torch.hypot(x, y) > 26).numpy(), constant(0.9, 0.6).copy()
    frames = np.where(background[..., None], 0.2, FRAMES)
    target[30:36] = 0.0
    errors = measured_motion(frames, target, ~background, steps=1, period=1)
    assert errors.direction < 3 and errors.speed_ratio == pytest.approx(1, abs=0.05)


def test_errors_are_weighted():
    motion = torch.tensor([[[[1.0, 0.0]], [[0.0, 2.0]]]])
    target = torch.tensor([[[[1.0, 1.0]], [[0.0, 0.0]]]])
    errors = motion_errors(motion, target, torch.tensor([[[3.0, 1.0]]]))
    assert errors.direction == pytest.approx(90 / 4)
    assert errors.speed_ratio == pytest.approx(1.25)
    assert errors.speed_spread == pytest.approx(np.sqrt(0.75 * 0.25**2 + 0.25 * 0.75**2))
    assert errors.end_point == pytest.approx(np.sqrt(5) / 4)


@pytest.mark.parametrize(
    ("change", "error", "message"),
    [
        ({"frames": FRAMES[:1]}, ImageError, "film"),
        ({"frames": FRAMES[..., 0]}, ImageError, "film"),
        ({"target": constant(1, 0)[1:]}, ConfigError, "target of shape"),
        ({"mask": MASK[1:]}, ConfigError, "mask of shape"),
        ({"target": constant(np.nan, 0)}, ConfigError, "NaN"),
        ({"target": constant(0, 0)}, ConfigError, "no pixel"),
        ({"mask": 0 * MASK}, ConfigError, "no pixel"),
        ({"steps": 0}, ConfigError, "above 0"),
        ({"period": -1}, ConfigError, "above 0"),
    ],
)
def test_films_that_cannot_be_measured(change, error, message):
    arguments = {"frames": FRAMES, "target": constant(1, 0), "mask": MASK, "steps": 1, "period": 1} | change
    with pytest.raises(error, match=message):
        measured_motion(**arguments)
