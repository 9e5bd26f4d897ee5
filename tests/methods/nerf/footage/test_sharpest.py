"""Which frames are kept: measures on patterns with known blur, exposure and repetition."""

import numpy as np
import pytest
from scipy import ndimage

from mitex.methods.nerf.footage.pictures import Picture
from mitex.methods.nerf.footage.sharpest import blurred_photos, faults, frame_quality, reasons, sharpest

NOISE = np.random.default_rng(0).normal(size=(120, 700))
WAVES = ndimage.gaussian_filter(NOISE, 1.0) + 8 * ndimage.gaussian_filter(NOISE, 8.0)
PATTERN = 128 + 40 * WAVES / WAVES.std()


def frame(shift=0, blur=0, gain=1.0, noise=2.0, seed=0):
    """A window of a pattern, blurred along its rows, exposed and with noise."""
    view = PATTERN[:, shift : shift + 160]
    view = ndimage.uniform_filter1d(view, blur, axis=1) if blur else view
    view = gain * view + noise * np.random.default_rng(seed).normal(size=view.shape)
    return np.clip(view, 0, 255).astype(np.uint8)[..., None].repeat(3, axis=2)


def test_blur_lowers_sharpness_and_exposure_does_not():
    sharp = frame_quality(frame()).sharpness
    blurred = [frame_quality(frame(blur=width)).sharpness for width in (3, 6, 12)]
    assert sharp > blurred[0] > blurred[1] > blurred[2] and blurred[2] < 0.6 * sharp
    assert frame_quality(frame(gain=0.6)).sharpness == pytest.approx(sharp, rel=0.1)


def test_the_sharpest_of_every_window_is_kept():
    blurs = [0, 4, 9, 5, 5, 0, 7, 8, 0, 9, 9, 3]
    pictures = [Picture(str(k), frame(20 * k, blur)) for k, blur in enumerate(blurs)]
    assert [p.name for p, _ in sharpest(pictures, 12, 4)] == ["0", "5", "8", "11"]
    assert [p.name for p, _ in sharpest(pictures, 12, 12)] == [str(k) for k in range(12)]
    # A video whose header promises more frames than there are.
    assert [p.name for p, _ in sharpest(pictures[:7], 12, 4)] == ["0", "5", "6"]


def test_the_first_picture_stays_since_a_box_may_be_in_it():
    pictures = [Picture(str(k), frame(20 * k, blur)) for k, blur in enumerate([9, 4, 0, 5, 0, 7])]
    assert [p.name for p, _ in sharpest(pictures, 6, 2)] == ["0", "4"]


def test_flawed_frames_are_named():
    frames = [frame(24 * k, seed=k) for k in range(14)]
    frames[3] = frame(72, blur=25)
    frames[6] = frame(144, gain=0.5)
    frames[10] = frame(217, seed=99)  # a pixel beside the one before, with other noise
    verdicts = faults([frame_quality(one) for one in frames])
    assert {k: v for k, v in enumerate(verdicts) if v} == {3: "blurred", 6: "exposure", 10: "alike"}
    assert reasons(verdicts) == "1 blurred, 1 too dark or too bright, 1 like the one before"
    assert reasons(["", ""]) == ""


def test_blurred_photos_alone_go():
    """Photos may be alike or lit in another way; all stay if too few are left."""
    frames = [frame(24 * k, seed=k) for k in range(14)]
    frames[0], frames[3], frames[6], frames[10] = (
        frame(blur=25),
        frame(72, blur=25),
        frame(144, gain=0.5),
        frame(217, seed=99),
    )
    qualities = [frame_quality(one) for one in frames]
    assert [k for k, verdict in enumerate(blurred_photos(qualities)) if verdict] == [0, 3]
    assert not any(blurred_photos(qualities[:8])) and faults(qualities[:8])[3] == "blurred"
    assert blurred_photos([]) == []


def test_drift_of_the_exposure_is_no_flaw():
    qualities = [frame_quality(frame(24 * k, gain=1.0 - 0.04 * k)) for k in range(14)]
    assert not any(faults(qualities))
