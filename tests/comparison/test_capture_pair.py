"""What is measured of captured textures: planes beside photos, and held-out views."""

from pathlib import Path
from types import SimpleNamespace

import numpy as np
import pytest

from mitex.batch import Job, Report, Row
from mitex.comparison import capture_pair
from mitex.comparison.capture_pair import CapturePair
from mitex.comparison.kinds import KINDS
from mitex.comparison.measures import CAPTURES
from mitex.comparison.plan import prepared, source_of
from mitex.comparison.presets import preset_plan
from mitex.comparison.results import VIEW, results_of
from mitex.evaluation.windows import select_windows
from mitex.mesh import Mesh, icosphere
from mitex.methods.baselines import quilted
from mitex.methods.nerf.field.raycast import Raycaster
from tests.methods.nerf.tiny import tiny_capture

VIEWS = {"psnr", "ssim", "vgg"}


class Photos:
    """A texture that looks as the photos do, noisier or less so."""

    def __init__(self, noise):
        self.noise = noise

    def on_plane(self, along):
        rng = np.random.default_rng(0)
        return lambda window: window.rendering(
            (window.photo + self.noise * rng.normal(size=window.photo.shape)).reshape(-1, 3)
        )


class OnItsObject:
    """A texture that can be looked at where it was captured alone."""

    def in_place(self):
        """Nothing that could be rendered."""


@pytest.fixture
def pair(place, monkeypatch):
    capture, ball = tiny_capture(side=160, spp=1), icosphere(20)
    base = Mesh(0.7 * ball.vertices, ball.faces, name="ball")
    monkeypatch.setattr(capture_pair, "capture_of", lambda _: capture)
    monkeypatch.setattr(capture_pair, "base_of", lambda _: SimpleNamespace(mesh=base))
    raycaster = Raycaster(base, capture)
    surfaces = [raycaster(view) for view in range(len(capture))]
    windows = select_windows(capture, surfaces, np.random.default_rng(0), 48, 2)
    monkeypatch.setattr(capture_pair, "windows_of", lambda _: windows)
    return CapturePair("photos", "ball.obj")


def test_what_looks_like_the_photos_is_near(pair, monkeypatch, place):
    numbers = []
    for noise in (0.0, 0.2):
        monkeypatch.setattr(capture_pair, "load", lambda _, noise=noise: Photos(noise))
        numbers.append(pair.numbers(None, place))
    near, far = numbers
    keys = {measure.key for measure in CAPTURES} - VIEWS
    assert near.keys() == far.keys() <= keys and {"plane_0", "plane_40", "planes"} <= near.keys()
    assert max(near.values()) < 1e-3 and all(far[key] > 0.1 for key in far)
    angles = [far[key] for key in far if key.startswith("plane_")]
    assert far["planes"] == pytest.approx(np.mean(angles))
    assert pair.floor().keys() == near.keys() and min(pair.floor().values()) > 0


def test_photos_without_windows_have_no_planes(pair, monkeypatch, place):
    """Rather than means of nothing, which no JSON file can hold."""
    monkeypatch.setattr(capture_pair, "windows_of", lambda _: {})
    monkeypatch.setattr(capture_pair, "load", lambda _: Photos(0.0))
    assert pair.numbers(None, place) == pair.floor() == {}


def test_views_are_measured_where_a_texture_was_captured(pair, monkeypatch, place):
    """Of the views that are held out, and of nothing else."""
    shown = []

    def views(field, capture):
        shown.append(len(capture))
        photo = np.full((16, 16, 3), 0.5, np.float32)
        return [(photo + 0.1, photo)]

    monkeypatch.setattr(capture_pair, "render_views", views)
    monkeypatch.setattr(capture_pair, "load", lambda _: OnItsObject())
    numbers = pair.numbers(None, place)
    assert numbers.keys() == VIEWS and numbers["psnr"] == pytest.approx(20, abs=1e-3)
    assert shown == [len(pair.capture.split()[1])]


def test_its_picture_is_a_square_photo(pair):
    assert pair.image.shape == (160, 160, 3) and pair.image[0, 0].tolist() == [1, 1, 1]
    assert pair.image.min() < 0.9


def test_flat_pictures_and_ours_can_be_laid_flat():
    image = np.full((8, 8, 3), 0.5, np.float32)
    light = [4.0, 0.0, 1.0] + [0.0] * 13
    dark, lit = (quilted.QuiltedTexture(image, 0.1, about) for about in ({}, {"light": light}))
    assert isinstance(lit, capture_pair.LaidFlat) and not isinstance(lit, capture_pair.Captured)
    up = np.array([0.0, 0.0, 1.0])
    assert dark.on_plane(up).brightness is None
    shine = lit.on_plane(up).brightness
    assert shine is not None and shine(up) > shine(-up)


def test_what_is_put_on_no_mesh_has_views_alone(pair, monkeypatch):
    """They are squares, like the photo; planes are left out, and no base shape is looked for."""
    alone = CapturePair("photos", None)
    monkeypatch.setattr(capture_pair, "base_of", None)
    monkeypatch.setattr(capture_pair, "load", lambda _: OnItsObject())
    monkeypatch.setattr(capture_pair, "render_view", lambda *_: (np.zeros((4, 8, 3)), None))
    (kind,) = pictures = alone.pictures(None, Path("run"))
    assert kind == VIEW and pictures[kind].shape == (8, 8, 3)
    assert pictures[kind][:, 0, 0].tolist() == [1, 1, 0, 0, 0, 0, 1, 1]
    assert alone.floor() == {} and alone.key != pair.key


def row(id, words, needs, seconds, memory):
    """Of a job that is done."""
    about = {"method": id, "exemplar": "c", "seed": 0}
    job = Job(id, tuple(words.split()), (), f"results/{id}", needs, about)
    return Row(job, "done", {"seconds": seconds, "memory": memory})


def test_a_run_of_a_run_is_of_the_first_one_s_exemplar(tmp_path):
    """And costs what both cost."""
    rows = (
        row("nerf", "fit nerf --capture /c", None, 10.0, 7),
        row("flat", "fit quilted --texture results/nerf", "nerf", 2.0, 3),
        row("apply", "apply results/flat --mesh vase --out a.glb", "flat", 1.0, 5),
    )
    (result,) = results_of(Report(tmp_path, rows), "capture")
    assert result.exemplar == "/c" and result.run == tmp_path / "results" / "flat"
    assert result.numbers == {"fit_seconds": 12.0, "apply_seconds": 1.0, "memory": 7.0}


def test_a_fit_that_nothing_needs_is_a_result_without_a_mesh(tmp_path):
    rows = (row("a", "fit plain_field --capture /c", None, 9.0, 5),)
    (result,) = results_of(Report(tmp_path, rows), "capture")
    assert result.pair == ("/c", None) and result.asset is None and result.run == tmp_path / "results" / "a"
    assert result.numbers == {"fit_seconds": 9.0, "memory": 5.0}


def test_the_preset_compares_captures(tmp_path):
    plan = prepared(preset_plan("nerf-table2", tmp_path))
    assert source_of(plan) == "capture" and KINDS["capture"].measures[: len(CAPTURES)] == CAPTURES
    assert [part.of for part in plan.methods] == [
        *(None, "nerf", "nerf", None),
        *(None, "nerf_paper", "nerf_paper", None),
    ]
    assert [part.output for part in plan.methods] == 2 * ["glb", "glb", "glb", "none"]
