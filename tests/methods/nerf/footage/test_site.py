"""Up is found, whatever world the cameras are in; and what was found is kept."""

import numpy as np
import pytest

from mitex.methods.nerf.capture.visual_hull import project
from mitex.methods.nerf.footage import site
from mitex.methods.nerf.footage.site import find_site, to_upright
from tests.methods.nerf.footage import stage


def rotation(rng):
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    return turn * np.sign(np.linalg.det(turn))


def test_up_is_where_the_pictures_have_their_tops(rng):
    world = rotation(rng)
    poses = np.stack(stage.POSES)
    for pose in poses:  # an unsteady hand rolls the camera by a degree or so
        angle = 0.02 * rng.normal()
        pose[:, :2] = pose[:, :2] @ [[np.cos(angle), -np.sin(angle)], [np.sin(angle), np.cos(angle)]]
    turn = to_upright(world @ poses)
    assert np.allclose(turn @ turn.T, np.eye(3), atol=1e-9) and np.linalg.det(turn) > 0
    assert (turn @ world @ (0.0, 0.0, 1.0))[2] > np.cos(np.radians(1.5))
    first = turn @ world @ poses[0, :, 2]
    assert abs(first[1]) < 1e-9 and first[0] > 0


@pytest.mark.usefixtures("own_cache")
def test_a_site_is_found_once_and_points_are_where_they_are_seen(tmp_path, monkeypatch):
    names = [f"{k}.jpg" for k in range(stage.VIEWS)]
    for name in names:
        (tmp_path / name).write_text(name)
    calls = []

    def known(folder, names):
        calls.append(names)
        return stage.structure(names, np.random.default_rng(0))

    monkeypatch.setattr(site, "reconstruct", known)
    first, again = find_site(tmp_path, names), find_site(tmp_path, names)
    assert len(calls) == 1
    for key in ("points", "sightings", "cameras"):
        assert np.array_equal(getattr(first, key), getattr(again, key))
    (tmp_path / names[2]).write_text("another picture")
    find_site(tmp_path, names)
    assert len(calls) == 2

    assert first.distance == pytest.approx(2.8, rel=1e-6)
    assert first.middle == pytest.approx(first.points[:300].mean(axis=0), abs=0.1)
    for k, view in enumerate(first.views):
        seen = first.points[first.seen(k)]
        pixels, depth = project(seen, view.pose, view.intrinsics, view.distortion)
        inside = (pixels > -1).all(axis=1) & (pixels < (stage.WIDTH + 1, stage.HEIGHT + 1)).all(axis=1)
        assert len(seen) > 100 and (depth > 0).all() and inside.all()
