"""What to film again, from cameras at known places."""

import math

import numpy as np

from mitex.methods.nerf.capture.visual_hull import View
from mitex.methods.nerf.footage.coverage import advice
from tests.methods.nerf.footage.stage import INTRINSICS, pose_at


def views(places, size=60):
    """Views from (azimuth, elevation) in degrees, of masks of `size` pixels in 120."""
    mask = np.zeros((120, 160), bool)
    mask[(120 - size) // 2 : (120 + size) // 2, 40:70] = True
    return [View(mask, pose_at(math.radians(a), math.radians(e)), INTRINSICS, np.zeros(4)) for a, e in places]


def said(places, **options):
    return advice(views(places, **options), np.array([0.0, 0.0, 0.45]))


RINGS = [(a + 17, e) for e in (10, 38, 65) for a in range(0, 360, 15)]


def test_three_rings_are_enough():
    assert said(RINGS) == []


def test_a_missing_ring():
    (line,) = said([place for place in RINGS if place[1] < 60])
    assert line == "film it all around from above: no picture within 27 degrees"
    (line,) = said([place for place in RINGS if place[1] != 38])
    assert line == "film it all around from half above: no picture within 27 degrees"


def test_one_ring_is_not_all_around():
    lines = said([(a, 38) for a in range(0, 360, 45)])
    assert [line.split(":")[0] for line in lines] == [
        "film it all around level with it",
        "film it all around from above",
    ]


def test_two_rings_leave_a_gap_between_them():
    (line,) = said([(a, e) for e in (12, 65) for a in range(0, 360, 45)])
    assert line.startswith("film it all around from half above: no picture within 26")


def test_eight_pictures_make_a_ring():
    assert said([(a, e) for e in (12, 38, 65) for a in range(0, 360, 45)]) == []


def test_a_missing_side():
    """The first picture is the front; counterclockwise from above comes the right side."""
    for side, turn in (("the right side", 90), ("the back", 180), ("the left side", 270)):
        away = [(a, e) for a, e in RINGS if abs((a - 17 - turn + 180) % 360 - 180) > 40 or e > 60]
        level = next(line for line in said(away) if "level with it" in line)
        assert level.startswith(f"film {side} level with it: no picture within 4")


def test_what_is_said_of_several_sides_is_true_of_each():
    """The middle of three missing sides lacks more than its neighbours."""
    away = [(a, e) for a, e in RINGS if abs((a - 17) % 360 - 180) > 82 or e > 60]
    level = next(line for line in said(away) if "level with it" in line)
    directions = [pose[:, 3] for pose in (view.pose for view in views(away))]
    towards = np.array(directions) - [0.0, 0.0, 0.45]
    towards /= np.linalg.norm(towards, axis=1, keepdims=True)
    gaps = []
    for turn in (135, 180, 225):
        azimuth, height = math.radians(17 + turn), math.radians(12)
        aim = [math.cos(azimuth) * math.cos(height), math.sin(azimuth) * math.cos(height), math.sin(height)]
        gaps.append(math.degrees(math.acos((towards @ aim).max())))
    assert max(gaps) > min(gaps) + 5
    sides = "the back right, the back and the back left"
    assert level == f"film {sides} level with it: no picture within {min(gaps):.0f} degrees"


def test_an_object_that_is_small_or_cut_off():
    assert said(RINGS, size=30) == ["go nearer: the object fills 25 % of the picture"]
    assert said(RINGS, size=120) == ["step back: the frame cuts the object off in 72 of 72 pictures"]
