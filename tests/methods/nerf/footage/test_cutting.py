"""Masks of a scene whose true masks are known, in each of the ways, and guesses that cannot be made."""

import math
import re
from dataclasses import replace
from pathlib import Path

import cv2
import numpy as np
import pytest

from mitex.errors import CaptureError, ConfigError
from mitex.methods.nerf.capture.visual_hull import Hull, View
from mitex.methods.nerf.footage import cutting
from mitex.methods.nerf.footage.cutting import cut_out
from mitex.methods.nerf.footage.guess import on_table
from mitex.methods.nerf.footage.mask_method import mask_method
from mitex.methods.nerf.footage.silhouette import silhouette
from mitex.methods.nerf.footage.site import Site, upright
from mitex.methods.nerf.footage.table import find_table
from tests.methods.nerf.footage import stage

SHOTS = [stage.shot(pose) for pose in stage.POSES]
NAMES = [f"{k:02}.jpg" for k in range(stage.VIEWS)]


@pytest.fixture(autouse=True)
def _coarse_volumes(monkeypatch):
    stage.coarse_volumes(monkeypatch)


@pytest.fixture(scope="module")
def site(tmp_path_factory) -> Site:
    folder: Path = tmp_path_factory.mktemp("site")
    for name in NAMES:
        (folder / name).touch()
    return upright(stage.structure(NAMES, np.random.default_rng(0)), folder)


def masks(site, words):
    return cut_out(site, [picture for picture, _ in SHOTS], mask_method(words))


def overlaps(cut):
    return [stage.overlap(mask, truth) for mask, (_, truth) in zip(cut, SHOTS, strict=True)]


def first_box():
    rows, columns = np.nonzero(SHOTS[0][1])
    left, top = columns.min() / stage.WIDTH, rows.min() / stage.HEIGHT
    wide, tall = np.ptp(columns) / stage.WIDTH, np.ptp(rows) / stage.HEIGHT
    return "box:" + ",".join(
        f"{100 * part:.1f}" for part in (left - 0.03, top - 0.03, wide + 0.06, tall + 0.06)
    )


def test_opencv_uses_as_many_threads_as_there_may_be(site, monkeypatch):
    """While it cuts; afterwards as many as before."""
    before, seen = cv2.getNumThreads(), []

    def guess(*_):
        seen.append(cv2.getNumThreads())
        raise CaptureError("enough", "stop")

    monkeypatch.setattr(cutting, "_guess", guess)
    monkeypatch.setattr(cutting, "allowed", lambda: 3)
    with pytest.raises(CaptureError, match="enough"):
        masks(site, "plane")
    assert seen == [3] and cv2.getNumThreads() == before


@pytest.mark.parametrize("words", ["plane", "hull", first_box()])
def test_masks_are_those_of_the_object(site, words):
    found = overlaps(masks(site, words))
    assert np.median(found) > 0.93 and min(found) > 0.8, words


def test_a_colour_takes_all_that_differs_from_it(site):
    """The table has another colour than the wall too, and the object stands on it."""
    bare = [np.where(truth[..., None], picture, np.array(stage.WALL, np.uint8)) for picture, truth in SHOTS]
    noise = np.random.default_rng(1).normal(size=bare[0].shape) * 6.0
    noisy = [np.clip(picture + noise, 0, 255).astype(np.uint8) for picture in bare]
    cut = cut_out(site, noisy, mask_method("colour:#28963c"))
    assert min(overlaps(cut)) > 0.93
    with pytest.raises(CaptureError, match="% of the pictures have the background's colour"):
        cut_out(site, noisy, mask_method("colour:#ff00ff"))


def test_a_picture_unlike_the_others_gets_no_mask(site):
    pictures = [picture for picture, _ in SHOTS]
    pictures[4] = np.full_like(pictures[4], stage.WALL)
    cut = cut_out(site, pictures, mask_method("colour:#28963c"))
    assert not cut[4].any() and sum(mask.any() for mask in cut) == stage.VIEWS - 1


def test_the_table_is_found_beside_the_object(site):
    table = find_table(site)
    assert table.normal[2] > math.cos(math.radians(0.5))
    assert np.abs(table.height(site.points[300:])).max() < 0.02
    guess = on_table(site)
    assert guess.on[:300].mean() > 0.85 and not guess.on[300:].any()
    assert guess.off[300:].all() and not guess.off[:300][site.points[:300, 2] > table.offset + 0.1].any()


def test_no_table(site):
    points = np.random.default_rng(5).normal(size=(400, 3))
    with pytest.raises(CaptureError, match="no table was found"):
        find_table(replace(site, points=points))
    with pytest.raises(CaptureError, match="no table was found"):
        find_table(replace(site, points=points[:2]))


def test_nothing_on_the_table(site):
    points = site.points.copy()
    points[:300] = points[300:600]
    with pytest.raises(CaptureError, match="only 0 points of an object"):
        on_table(replace(site, points=points))


def test_a_silhouette_covers_a_ball():
    voxels = np.indices((40,) * 3).reshape(3, -1).T
    inside = (np.linalg.norm((voxels + 0.5) / 20.0 - 1.0, axis=1) < 1.0).reshape((40,) * 3)
    hull = Hull(inside, np.full(3, -1.0), 0.05)
    pose = np.concatenate([np.eye(3), [[0.0], [0.0], [5.0]]], axis=1)
    view = View(np.zeros((200, 300), bool), pose, np.array([400.0, 400.0, 150.0, 100.0]), np.zeros(4))
    shown = silhouette(hull, view, (100, 150))
    radius = 200.0 / math.sqrt(5.0**2 - 1.0)  # of the circle that a ball is seen as
    y, x = np.mgrid[:100, :150] + 0.5
    off = np.hypot(x - 75.0, y - 50.0) - radius
    assert shown[off < -1.0].all() and not shown[off > 5.0].any()


@pytest.mark.parametrize(
    ("words", "message"),
    [
        ("", "'' is no way to mask; use plane, hull, box:"),
        ("boxes", "'boxes' is no way to mask"),
        ("plane:3", "'plane:3' is no way to mask"),
        ("box:1,2,3", "'box:1,2,3' is no way to mask"),
        ("box:60,0,60,10", "the box 60,0,60,10 is not inside the picture; give per cent"),
        ("box:0,50,10,51", "the box 0,50,10,51 is not inside the picture"),
        ("box:1..2,2,3,4", "'1..2,2,3,4' is no box; give four numbers, X,Y,W,H"),
        ("box:1,1,0,5", "the box 1,1,0,5 is not inside the picture"),
        ("colour:red", "'colour:red' is no way to mask"),
    ],
)
def test_methods_that_are_none(words, message):
    with pytest.raises(ConfigError, match=re.escape(message)):
        mask_method(words)
