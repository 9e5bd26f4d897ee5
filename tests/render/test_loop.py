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
    frames = 0.2 + 0.1 * signal(60, 20) + np.linspace(0, 0.6, 60)[:, None, None]
    loop = best_loop(frames, 5, 20, 40)
    shown = np.stack(list(loop.pictures(lambda k: frames[k])))
    assert len(shown) == loop.length
    steps = np.abs(np.diff(shown, axis=0)).max(axis=(1, 2))
    cut = list(Loop(loop.start, loop.length, 0, 0.0).pictures(lambda k: frames[k]))
    assert np.abs(shown[0] - shown[-1]).max() < 1.2 * steps.max()
    assert np.abs(cut[0] - cut[-1]).max() > 1.5 * np.abs(np.diff(cut, axis=0)).max()


def test_frames_fade_from_after_the_end_to_the_beginning():
    """Patterns that have nothing in common keep their contrast, which half of each would lose a third of."""
    frames = 0.5 + 0.1 * np.random.default_rng(0).standard_normal((9, 40, 40, 3))
    shown = list(Loop(0, 4, 3, 0.0).pictures(lambda k: frames[k]))
    for t, picture in enumerate(shown[:3]):
        likeness = [np.corrcoef(picture.ravel(), frames[k].ravel())[0, 1] for k in (4 + t, t)]
        weight = (t + 1) / 4
        assert np.allclose(likeness, np.array([1 - weight, weight]) / np.hypot(weight, 1 - weight), atol=0.12)
        assert picture.std() == pytest.approx(0.1, rel=0.12)
    assert np.array_equal(shown[3], frames[3].clip(0, 1))


def test_equal_frames_stay_as_they_are():
    frames = np.random.default_rng(0).uniform(size=(4, 5, 5, 3))
    shown = list(Loop(0, 4, 2, 0.0).pictures(lambda k: frames[k % 4]))
    assert np.allclose(shown, frames)
