"""Cameras of plain photos: an ellipsoid with a spotted skin, painted ray by ray from known places."""

import json
import math
import re
import sys

import numpy as np
import pytest
from PIL import Image

from mitex.errors import CaptureError, CaptureWarning, MissingPackage
from mitex.methods.nerf.capture import colmap
from mitex.methods.nerf.capture.capture import load_capture

RADII = np.array([1.0, 0.8, 0.7])
SIZE, FOCAL = 300, 400.0
COUNT = 24

pytestmark = pytest.mark.usefixtures("own_cache")


def pose_at(azimuth, elevation, distance):
    back = [
        math.cos(azimuth) * math.cos(elevation),
        math.sin(azimuth) * math.cos(elevation),
        math.sin(elevation),
    ]
    right = np.cross((0.0, 0.0, 1.0), back)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(back, right), back, distance * np.array(back)], axis=1)


POSES = [pose_at(2 * math.pi * k / COUNT, 0.3 + 0.12 * (k % 2), 3.3 + 0.2 * (k % 3)) for k in range(COUNT)]


def photo(pose):
    """(H, W, 4) uint8 of the ellipsoid, whose colour is a noise of its surface point."""
    x, y = np.meshgrid(*[np.arange(SIZE) + 0.5 - SIZE / 2] * 2)
    rays = np.stack([x, -y, np.full_like(x, -FOCAL)], axis=-1) @ pose[:, :3].T
    start, slope = pose[:, 3] / RADII, rays / RADII
    a, b, c = (slope**2).sum(-1), slope @ start, start @ start - 1
    root = b * b - a * c
    t = (-b - np.sqrt(np.maximum(root, 0.0))) / a
    points = pose[:, 3] + t[..., None] * rays
    return np.concatenate([skin(points), np.uint8(255) * (root > 0)[..., None]], axis=2)


def skin(points):
    """Colours (H, W, 3) uint8: waves of three sizes in random directions."""
    rng = np.random.default_rng(1)
    waves = rng.normal(size=(3, 60)) * np.repeat([8.0, 16.0, 32.0], 20)
    colours = rng.normal(size=(60, 3)).astype(np.float32)
    fields = np.cos(points.astype(np.float32) @ waves.astype(np.float32)) @ colours
    return np.clip(128 + 11.0 * fields, 0, 255).astype(np.uint8)


@pytest.fixture(scope="module")
def photos(tmp_path_factory):
    folder = tmp_path_factory.mktemp("photos")
    for k, pose in enumerate(POSES):
        Image.fromarray(photo(pose)).save(folder / f"p{k:02}.png")
    return folder


def test_cameras_and_points_are_found_up_to_a_similarity(photos, monkeypatch):
    structures, reconstruct = [], colmap.reconstruct
    monkeypatch.setattr(
        colmap, "reconstruct", lambda *args, **k: structures.append(reconstruct(*args, **k)) or structures[0]
    )
    capture = load_capture(photos)
    assert capture.names == tuple(f"p{k:02}.png" for k in range(COUNT))
    assert np.abs(capture.intrinsics[:, :2] / FOCAL - 1).max() < 0.03

    true = np.stack(POSES)
    scale, rotation, shift = fitted(capture.poses[:, :, 3], true[:, :, 3])
    placed = scale * capture.poses[:, :, 3] @ rotation.T + shift
    assert np.linalg.norm(placed - true[:, :, 3], axis=1).max() < 0.08
    turned = np.einsum("ij,njk,nlk->nil", rotation, capture.poses[:, :, :3], true[:, :, :3])
    assert np.arccos(np.clip((np.trace(turned, axis1=1, axis2=2) - 1) / 2, -1, 1)).max() < 0.03

    (structure,) = structures
    points = scale * capture.similarity.apply(structure.points) @ rotation.T + shift
    assert len(points) > 200
    assert np.quantile(np.abs(np.linalg.norm(points / RADII, axis=1) - 1), 0.9) < 0.05
    view, point = structure.sightings.T
    assert set(view) == set(range(COUNT)) and np.array_equal(np.unique(point), np.arange(len(points)))
    towards = true[view, :, 3] - points[point]
    assert (np.einsum("ij,ij->i", towards, points[point] / RADII**2) > 0).mean() > 0.95  # on the near side

    # The second time nothing is computed, and the folder was left as it was.
    monkeypatch.setattr(colmap, "_reconstruct", None)
    again = load_capture(photos)
    assert np.array_equal(again.poses, capture.poses)
    assert sorted(path.name for path in photos.iterdir()) == list(capture.names)


def fitted(source, target):
    """Scale, rotation and shift that take points (N, 3) nearest to others (Umeyama 1991)."""
    a, b = source - source.mean(0), target - target.mean(0)
    left, sizes, right = np.linalg.svd(b.T @ a)
    signs = np.array([1, 1, np.sign(np.linalg.det(left @ right))])
    rotation = (left * signs) @ right
    scale = (sizes * signs).sum() / (a**2).sum()
    return scale, rotation, target.mean(0) - scale * rotation @ source.mean(0)


def tree(placed):
    """What COLMAP would find for the first photos."""
    lens = {"fl_x": FOCAL, "w": SIZE, "h": SIZE}
    frames = [
        {"file_path": f"p{k:02}.png", "transform_matrix": POSES[k].tolist()} | lens for k in range(placed)
    ]
    return {"frames": frames}


def test_photos_without_a_pose_are_left_out_with_a_warning(photos, monkeypatch):
    monkeypatch.setattr(colmap, "VERSION", "some missing")
    monkeypatch.setattr(colmap, "_reconstruct", lambda folder, names: tree(12))
    with pytest.warns(CaptureWarning, match="12 of 24 photos could not be placed and are left out"):
        frames = colmap.photo_frames(photos)
    assert [frame.name for frame in frames] == [f"p{k:02}.png" for k in range(12)]


def test_a_damaged_cache_is_made_again(photos, monkeypatch):
    monkeypatch.setattr(colmap, "VERSION", "damaged")
    monkeypatch.setattr(colmap, "_reconstruct", lambda folder, names: tree(COUNT))
    cache = colmap.cache_dir() / "captures"
    before = set(cache.glob("*/transforms.json"))
    assert len(colmap.photo_frames(photos)) == COUNT
    (path,) = set(cache.glob("*/transforms.json")) - before
    for damage in ('{"fra', "{}", "[1]", '{"frames": 3}'):
        path.write_text(damage)
        assert len(colmap.photo_frames(photos)) == COUNT
        assert json.loads(path.read_text()) == tree(COUNT)


class Placed:
    """A stand-in for COLMAP's image."""

    has_pose = True

    def __init__(self, name):
        self.name = name


class Model:
    """A stand-in for COLMAP's model of the first photos."""

    def __init__(self, placed):
        self.images = {k: Placed(f"{k:05}.png") for k in range(placed)}


@pytest.mark.parametrize("model", [None, Model(5)])
def test_too_few_placed(photos, monkeypatch, model):
    monkeypatch.setattr(colmap, "_largest", lambda work, one_camera: model)
    monkeypatch.setattr(colmap, "VERSION", f"few {model}")
    assert_refused(photos, f"only {5 if model else 0} of 24 photos")


@pytest.mark.parametrize("kind", [RuntimeError, ValueError])
def test_colmap_fails(photos, monkeypatch, kind):
    """It is told in one line, and COLMAP says as much as before."""

    def extract(*_, **__):
        raise kind("no\n  features")

    pycolmap = pytest.importorskip("pycolmap")
    level = pycolmap.logging.minloglevel
    monkeypatch.setattr(colmap, "VERSION", f"failed {kind}")
    monkeypatch.setattr(pycolmap, "extract_features", extract)
    assert_refused(photos, "COLMAP failed (no features); find the cameras with another program")
    assert pycolmap.logging.minloglevel == level


@pytest.mark.parametrize(("count", "threads"), [(3, 3), (None, -1)])
def test_colmap_uses_as_many_threads_as_there_may_be(photos, monkeypatch, count, threads):
    pycolmap = pytest.importorskip("pycolmap")
    given = []

    def note(*arguments, **options):
        options = (*arguments, *options.values())
        given.extend(one.num_threads for one in options if hasattr(one, "num_threads"))
        return {}

    for name in ("extract_features", "match_exhaustive", "incremental_mapping"):
        monkeypatch.setattr(pycolmap, name, note)
    monkeypatch.setattr(colmap, "VERSION", f"threads {count}")
    monkeypatch.setattr(colmap, "allowed", lambda: count)
    assert_refused(photos, "only 0 of 24 photos")
    assert given == [threads] * 3


def test_too_few_photos(tmp_path):
    (tmp_path / "images").mkdir()
    Image.new("RGB", (8, 8)).save(tmp_path / "images" / "one.jpg")
    assert_refused(tmp_path, "has no transforms.json, and 1 photos")


def test_photos_without_masks_are_refused_at_once(photos, tmp_path, monkeypatch):
    monkeypatch.setattr(colmap, "_largest", None)
    for path in photos.iterdir():
        Image.open(path).convert("RGB").save(tmp_path / path.name)
    assert_refused(tmp_path, "p00.png has neither alpha nor a mask")


def test_masks_beside_photos_count(photos, tmp_path, monkeypatch):
    """With masks for all but one, that one is named."""
    monkeypatch.setattr(colmap, "_largest", None)
    (tmp_path / "images").mkdir()
    (tmp_path / "masks").mkdir()
    for path in photos.iterdir():
        Image.open(path).convert("RGB").save(tmp_path / "images" / path.name)
        if path.stem != "p07":
            Image.open(path).getchannel("A").save(tmp_path / "masks" / path.name)
    assert_refused(tmp_path, "p07.png has neither alpha nor a mask")


def test_a_folder_that_cannot_be_read(photos, monkeypatch):
    def denied(folder):
        raise PermissionError(13, "Permission denied")

    monkeypatch.setattr(colmap, "_photos", denied)
    assert_refused(photos, "cannot be read (Permission denied)")


def test_without_pycolmap(photos, monkeypatch):
    monkeypatch.setattr(colmap, "VERSION", "not installed")
    monkeypatch.setitem(sys.modules, "pycolmap", None)
    with pytest.raises(MissingPackage, match=r"pycolmap.*pip install 'mitex\[nerf\]'"):
        load_capture(photos)


def assert_refused(folder, words):
    with pytest.raises(CaptureError, match=re.escape(words)) as error:
        load_capture(folder)
    assert "\n" not in str(error.value)
