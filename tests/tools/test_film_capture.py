"""A film with its truth, and the errors of cameras that are known."""

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from mitex.mesh import icosphere
from mitex.methods.nerf.footage.pictures import footage
from tests.methods.nerf.footage.stage import POSES

ROOT = Path(__file__).parents[2]


@pytest.fixture(scope="module")
def tools():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "tools"))
        yield import_module("film_capture"), import_module("capture_errors")


def ball(rng):
    mesh = icosphere(8)
    grey = np.full(mesh.vertices.shape, 0.5)
    return None, import_module("capture_kit").Part(mesh, grey, grey[:, 0])


def test_a_film_shows_the_object_where_the_truth_says(tools, tmp_path, monkeypatch):
    film, _ = tools
    monkeypatch.setitem(film.KINDS, "woven", ball)
    words = ["--out", str(tmp_path), "--frames", "3", "--width", "64", "--spp", "1", "woven"]
    monkeypatch.setattr(sys, "argv", ["film_capture.py", *words])
    film.main()
    frames = list(footage(tmp_path / "woven.mp4", 64).read())
    assert len(frames) == 3 and frames[0].pixels.shape == (48, 64, 3)
    with np.load(tmp_path / "woven-truth.npz") as truth:
        poses, focal = truth["poses"], float(truth["focal"])
    assert poses.shape == (3, 4, 4) and focal == pytest.approx(32 / np.tan(np.radians(24)))
    for k, pose in enumerate(poses):
        mask = np.asarray(Image.open(tmp_path / "woven-masks" / f"{k:05}.png").convert("L")) > 127
        assert 0.1 < mask.mean() < 0.5
        middle = -pose[:3, 3] @ pose[:3, :3]
        column, row = 32 + focal * middle[0] / -middle[2], 24 - focal * middle[1] / -middle[2]
        rows, columns = np.nonzero(mask)
        assert abs(columns.mean() - column) < 3 and abs(rows.mean() - row) < 4


def test_errors_are_those_that_were_made(tools):
    """In another world the cameras are the same but for a turn of one and a shift of another."""
    _, errors = tools
    true = np.broadcast_to(np.eye(4), (len(POSES), 4, 4)).copy()
    true[:, :3] = POSES
    world = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0]
    world *= np.sign(np.linalg.det(world))
    poses = world @ true[:, :3]
    poses[:, :, 3] = 3.0 * poses[:, :, 3] + (1.0, 2.0, 3.0)
    angles, distances = errors.camera_errors(poses, true)
    assert angles.max() < 1e-4 and distances.max() < 1e-9
    turn = np.radians(2.0)
    poses[4, :, :3] @= [[np.cos(turn), -np.sin(turn), 0], [np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    angles, _ = errors.camera_errors(poses, true)
    assert angles[4] == pytest.approx(2.0) and np.delete(angles, 4).max() < 1e-4
