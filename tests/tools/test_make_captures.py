"""The script's captures: files that load, and a truth that is the truth."""

import json
import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest

from mitex.mesh import Mesh
from mitex.mesh.topology import boundary_edges
from mitex.methods.nerf.capture.capture import Capture, load_capture

ROOT = Path(__file__).parents[2]
QUICK = "woven"  # whose geometry takes a second
VIEWS, SIZE = 10, 48


@pytest.fixture(scope="module")
def script():
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(str(ROOT / "tools"))
        yield import_module("make_captures")


@pytest.fixture(scope="module")
def folder(script, tmp_path_factory) -> Path:
    out = tmp_path_factory.mktemp("captures")
    options = ["--out", str(out), "--views", str(VIEWS), "--resolution", str(SIZE), "--spp", "4", QUICK]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(sys, "argv", ["make_captures.py", *options])
        script.main()
    return out / QUICK


@pytest.fixture(scope="module")
def capture(folder) -> Capture:
    return load_capture(folder)


@pytest.fixture(scope="module")
def shape(script):
    return made(script, QUICK)


def made(script, name):
    return script.KINDS[name](np.random.default_rng([0, script.SEEDS[name]]))


def truth(folder, view):
    with np.load(folder / "truth" / f"{view:03}.npz") as file:
        return file["depth"], file["normal"].astype(np.float32)


def first_hit(origin, direction, corners):
    """Distance along a ray to the nearest of the triangles (F, 3, 3), and its normal (Moeller-Trumbore)."""
    a, u, v = corners[:, 0], corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]
    p = np.cross(direction, v)
    determinant = (u * p).sum(1)
    safe = np.where(np.abs(determinant) > 1e-16, determinant, np.inf)
    s = origin - a
    x, q = (s * p).sum(1) / safe, np.cross(s, u)
    y, t = (q @ direction) / safe, (v * q).sum(1) / safe
    t = np.where((x >= 0) & (y >= 0) & (x + y <= 1) & (t > 0) & np.isfinite(safe), t, np.inf)
    normal = np.cross(u[t.argmin()], v[t.argmin()])
    return t.min(), normal / np.linalg.norm(normal)


def test_the_capture_loads(capture, folder):
    assert len(capture) == VIEWS
    assert all(image.shape == (SIZE, SIZE, 4) for image in capture.images)
    covered = np.mean([(image[..., 3] > 127).mean() for image in capture.images])
    assert 0.3 < covered < 0.8
    lit = np.concatenate([image[image[..., 3] > 250] for image in capture.images])[:, :3]
    assert 40 < lit.mean() < 200 and lit.std(axis=0).min() > 15
    light = json.loads((folder / "transforms.json").read_text())["light"]
    assert light["ambient"] > 0 and all(abs(np.linalg.norm(k["towards"]) - 1) < 1e-6 for k in light["lobes"])


def test_cameras_stand_all_around(capture):
    back = capture.poses[:, :, 2]
    assert np.linalg.norm(back.mean(axis=0)) < 0.15
    apart = np.sort(np.arccos(np.clip(back @ back.T, -1, 1)), axis=1)[:, 1]
    assert apart.min() > 0.5 * np.sqrt(4 * np.pi / VIEWS)


def test_true_depth_and_normal_are_those_of_the_mesh(capture, folder, shape, rng):
    mesh = shape[1].mesh
    corners = mesh.vertices[mesh.faces].astype(np.float64)
    for view in (0, 7):
        depth, normal = truth(folder, view)
        rows, columns = rng.integers(0, SIZE, (2, 5))
        origins, rays = capture.rays(view, np.stack([columns + 0.5, rows + 0.5], axis=1))
        origins = capture.similarity.inverse(origins)
        for origin, ray, distance, towards in zip(
            origins, rays.astype(float), depth[rows, columns], normal[rows, columns], strict=True
        ):
            expected, expected_normal = first_hit(origin, ray, corners)
            assert distance == pytest.approx(expected, abs=2e-4)
            if np.isfinite(expected):
                assert abs(expected_normal @ towards) > 0.99 and ray @ towards < 0


def test_alpha_is_where_the_rays_hit(capture, folder):
    for view, image in enumerate(capture.images):
        hit = np.isfinite(truth(folder, view)[0])
        assert ((image[..., 3] > 127) == hit).mean() > 0.97


def test_every_true_point_is_in_the_scene_cube(capture, folder):
    for view in range(VIEWS):
        depth = truth(folder, view)[0]
        rows, columns = np.nonzero(np.isfinite(depth))
        origins, rays = capture.rays(view, np.stack([columns + 0.5, rows + 0.5], axis=1))
        points = origins + rays * (depth[rows, columns] / capture.similarity.scale)[:, None]
        assert np.abs(points).max() <= 0.75


def test_base_is_closed_and_below_the_texture(folder, shape):
    base = Mesh.load(folder / "base.obj")
    assert len(boundary_edges(base.faces, len(base.vertices))) == 0
    assert np.allclose(base.vertices, shape[0].mesh().vertices, atol=1e-5)
    reach = np.linalg.norm(shape[1].mesh.vertices, axis=1).max()
    assert np.linalg.norm(base.vertices, axis=1).max() < reach


def test_photos_are_made_again(script, shape, folder, capture):
    """The same seed gives the same picture."""
    studio = import_module("capture_studio")
    pose = np.array(json.loads((folder / "transforms.json").read_text())["frames"][3]["transform_matrix"])
    again = studio.Studio(shape[1], SIZE).photo(pose, 4, script.SEEDS[QUICK] + 3)
    assert np.abs(again.astype(int) - capture.images[3]).max() <= 1


def test_unknown_names_are_refused(script, monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["make_captures.py", "moss"])
    with pytest.raises(SystemExit) as error:
        script.main()
    assert error.value.code == 2 and "no such capture: moss" in capsys.readouterr().err


@pytest.mark.parametrize(
    "name", [QUICK, *(pytest.param(n, marks=pytest.mark.slow) for n in ("durian", "grass", "cobbles"))]
)
def test_geometry(script, shape, name):
    base, part = shape if name == QUICK else made(script, name)
    assert np.isfinite(part.mesh.vertices).all() and np.isfinite(part.mesh.normals).all()
    assert part.mesh.face_areas.min() > 0
    assert part.colours.shape == part.mesh.vertices.shape
    assert part.roughness.shape == (len(part.colours),)
    assert part.colours.min() >= 0 and part.colours.max() <= 1 and part.colours.std(axis=0).max() > 0.03
    assert part.roughness.min() > 0.1 and part.roughness.max() <= 1
    # The meso-structure stays near its base.
    height = np.linalg.norm(part.mesh.vertices - base.onto(part.mesh.vertices.astype(np.float64)), axis=1)
    assert 0.03 < np.quantile(height, 0.999) < 0.25
