"""A folder with an exemplar and a mesh, and comparisons in it that are small and run in this process."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

import pytest

from mitex.asset import clay
from mitex.batch import Plan
from mitex.comparison import capture_pair
from mitex.comparison.plan import prepared
from mitex.mesh import Mesh, icosphere
from mitex.methods.nerf import NerfTexture
from tests.batch.in_this_process import InThisProcess
from tests.cli import bad_files as bad
from tests.cli.test_nerf import holed, save
from tests.methods.fits import few_patches, untrained_bases
from tests.methods.nerf.capture.ellipsoid import write


@pytest.fixture
def place(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """The working folder, with a.png and ball.obj."""
    bad.image(tmp_path / "a.png", (96, 96))
    write_mesh(tmp_path / "ball.obj")
    monkeypatch.chdir(tmp_path)
    return tmp_path


@pytest.fixture
def small(monkeypatch: pytest.MonkeyPatch) -> None:
    """Jobs run in this process, with few and small patches and pictures; words are judged by one view."""
    monkeypatch.setattr("mitex.batch.task.Process", InThisProcess)
    values = {"look_pair.PATCHES": 2, "look_pair.WINDOWS": 1, "inputs.CELL": 16, "inputs.SPP": 1}
    for name, value in values.items():
        monkeypatch.setattr(f"mitex.comparison.{name}", value)
    monkeypatch.setattr("mitex.render.sides.AZIMUTHS", (0,))
    monkeypatch.setattr("mitex.render.sides.ELEVATIONS", (0.0,))


@pytest.fixture
def few_patches_of_relief(monkeypatch: pytest.MonkeyPatch) -> None:
    """Reliefs are judged by one picture and two patches of one size."""
    values = {
        "comparison.relief_pair.VIEWS": 1,
        "comparison.relief_pair.SIDE": 48,
        "evaluation.form.PATCHES": 2,
        "evaluation.form.SIZES": (1.0,),
        "evaluation.form.LAYERS": ("relu2_2",),
    }
    for name, value in values.items():
        monkeypatch.setattr(f"mitex.{name}", value)


@pytest.fixture
def planes_alike(monkeypatch: pytest.MonkeyPatch) -> None:
    """Captured textures on planes are neither rendered nor measured: all are as far from the photos."""
    monkeypatch.setattr(NerfTexture, "on_plane", lambda *_: None)
    monkeypatch.setattr(capture_pair.CapturePair, "_along", None)
    for name, distance in (("plane_distances", 2.0), ("photo_distances", 1.0)):
        monkeypatch.setattr(capture_pair, name, lambda *_, distance=distance: {0: distance})
    monkeypatch.setattr(capture_pair, "windows_of", lambda _: {})


@pytest.fixture
def grey(monkeypatch: pytest.MonkeyPatch) -> None:
    """Jobs learn nothing and write grey meshes."""
    monkeypatch.setattr("mitex.batch.task.Process", Grey)


def small_capture(folder: Path, patch: pytest.MonkeyPatch) -> None:
    """Photos of 8 views, of which one is held out, and a coarse base.obj, which is taken as it is; what is
    solid is looked for on the grid of cells that rays see, and few patches are laid."""
    write(folder / "photos", 8)
    save(holed(30), folder / "base.obj")
    patch.setattr("mitex.methods.nerf.base.base_shape.FINE", math.inf)
    patch.setattr("mitex.methods.nerf.use.extract.CELLS", 1)
    untrained_bases(patch)
    few_patches(patch)


def words_plan(words: Sequence[str], names: Sequence[str] = ("nca", "x_mesh")) -> Plan:
    """Textures from words on the ball, to be compared."""
    table = {"exemplars": list(words), "meshes": ["ball.obj"], "source": "text"}
    return prepared(Plan.of({"methods": dict.fromkeys(names, table)}))


def write_mesh(path: Path) -> None:
    ball = icosphere(6)
    lines = [f"v {x} {y} {z}" for x, y, z in ball.vertices.tolist()]
    lines += [f"f {a} {b} {c}" for a, b, c in (ball.faces + 1).tolist()]
    path.write_text("\n".join(lines) + "\n")


class Grey(InThisProcess):
    """Writes what a job would write, without any texture."""

    failing: tuple[str, ...] = ()  # methods

    def wait(self) -> tuple[int, int]:
        command, what, *options = self.words
        out = self.folder / options[options.index("--out") + 1]
        if command == "fit":
            out.mkdir(parents=True)
            return (2 if what in self.failing else 0), 1000
        clay(Mesh.load(options[options.index("--mesh") + 1])).export(out)
        return 0, 1000
