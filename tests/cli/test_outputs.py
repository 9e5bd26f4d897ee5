"""No command writes over what it reads, or over what somebody else wrote."""

import io
import sys

import pytest

from mitex.asset import Asset
from mitex.cli import main
from mitex.mesh import icosphere
from tests.cli import bad_files as bad
from tests.cli.refusals import apply, check_refused
from tests.export.common import wavy


@pytest.fixture
def scene(files):
    """A mesh with material and texture, links to it, and an asset of ours."""
    (files / "mine.obj").write_text("mtllib mine.mtl\n" + bad.CUBE)
    (files / "mine.mtl").write_text("newmtl mine\nmap_Kd photo.png\n")
    bad.image(files / "photo.png")
    (files / "soft.obj").symlink_to("mine.obj")
    (files / "hard.obj").hardlink_to("mine.obj")
    wavy(icosphere(2)).baked(64).export(files / "ours.obj")
    return files


def _contents(folder):
    return {path: path.read_bytes() for path in folder.rglob("*") if path.is_file()}


@pytest.mark.parametrize(
    ("command", "message"),
    [
        (apply(mesh="mine.obj", out="mine.obj"), "'mine.obj' is an input"),
        (apply(mesh="mine.obj", out="./out/../mine.obj"), "is an input"),
        (apply(mesh="soft.obj", out="mine.obj"), "'mine.obj' is an input"),
        (apply(mesh="mine.obj", out="soft.obj"), "'soft.obj' is an input"),
        (apply(mesh="mine.obj", out="hard.obj"), "'hard.obj' is an input"),
        (apply(mesh="good.obj", out="mine.obj"), "mine.mtl"),
        (apply(mesh="ours.obj", out="./ours.obj"), "is an input"),
        (["render", "ours.obj", "--out", "ours_albedo.png"], "'ours_albedo.png' is an input"),
    ],
)
def test_inputs_and_files_of_others_are_kept(scene, capsys, command, message):
    before = _contents(scene)
    check_refused(scene, command, message, capsys)
    assert _contents(scene) == before


def test_a_file_of_ours_may_be_written_again(scene, capsys):
    assert (
        main(
            apply(
                "--subdivide 0 --steps 1 --resolution 64", mesh="good.obj", model="honeycomb", out="ours.obj"
            )
        )
        == 0
    )
    assert Asset.load(scene / "ours.obj").mesh.vertices.shape == (8, 3)
    assert (scene / "mine.obj").read_text() == "mtllib mine.mtl\n" + bad.CUBE


def test_a_name_that_stdout_cannot_encode(files, monkeypatch):
    """The file is there, and its name is printed as far as it can be."""
    bad.model(files / "m.safetensors")
    name = "out/\u00fc\u2603.ply"
    printed = io.BytesIO()
    monkeypatch.setattr(sys, "stdout", io.TextIOWrapper(printed, encoding="ascii"))
    assert main(apply("--subdivide 0 --steps 1 --quiet", model="m.safetensors", out=name)) == 0
    assert printed.getvalue() == b"out/\\xfc\\u2603.ply\n" and (files / name).is_file()
