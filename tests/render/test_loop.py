"""Where a film closes, and the frames that fade."""

import numpy as np
import pytest

from mitex.render.loop import Loop, best_loop


def signal(frames, period):
    """Pictures of one pixel that go round in a circle."""
    angle = 2 * np.pi * np.arange(frames) / period
    return np.stack([np.cos(angle), np.sin(angle)], axis=1).reshape(frames, 1, 2)


@pytest.mark.parametrize(("fade", "period"), [(0, 11), (4, 11), (4, 17)])
def test_a_periodic_film_closes_after_a_period(fade, period):
    """The longest multiple of it that fits, and with no difference between its ends."""
    loop = best_loop(signal(60, period), fade, 10, 40)
    assert loop.length == 40 // period * period and loop.difference < 1e-6


def test_the_best_start_is_looked_for():
    """Frames 7 to 9 come back at 31 to 33, everything else is new."""
    frames = np.random.default_rng(0).uniform(size=(50, 3, 3))
    frames[31:34] = frames[7:10] + 0.001
    loop = best_loop(frames, 3, 12, 40)
    assert (loop.start, loop.length) == (7, 24) and np.isclose(loop.difference, 0.001)


def test_the_seam_of_a_faded_loop_is_like_any_other_step():
    """In a signal that drifts; without the fade it would jump."""
    frames = signal(60, 20) + np.linspace(0, 3, 60)[:, None, None]
    loop = best_loop(frames, 5, 20, 40)
    shown = np.stack(list(loop.pictures(lambda k: frames[k])))
    assert len(shown) == loop.length
    steps = np.abs(np.diff(shown, axis=0)).max(axis=(1, 2))
    cut = list(Loop(loop.start, loop.length, 0, 0.0).pictures(lambda k: frames[k]))
    assert np.abs(shown[0] - shown[-1]).max() < 1.2 * steps.max()
    assert np.abs(cut[0] - cut[-1]).max() > 1.2 * np.abs(np.diff(cut, axis=0)).max()


def test_weights_of_the_fade():
    frames = [np.full(1, value, np.float32) for value in (0, 0, 0, 0, 8, 8, 8)]
    shown = [float(value[0]) for value in Loop(0, 4, 3, 0.0).pictures(lambda k: frames[k])]
    assert shown == [6, 4, 2, 0]
