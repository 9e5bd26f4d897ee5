"""Places that results cannot be written to, and run folders that a fit cannot go on in."""

import os
from pathlib import Path

import pytest

from tests.cli import bad_files as bad
from tests.cli.refusals import QUICK, check_refused, fit


class TestOutputsBeforeTheWork:
    """Places that cannot be written to are refused before any input is read or prepared."""

    @pytest.fixture(autouse=True)
    def no_work(self, files, monkeypatch):
        """Reading an input would end the test; a folder is there that cannot be written to."""
        for name in ("mitex.exemplar.read_image", "mitex.mesh.load.read", "mitex.export.glb.read_glb"):
            monkeypatch.setattr(name, pytest.fail)
        (files / "locked").mkdir(mode=0o500)
        real = os.access
        locked = files / "locked"  # the superuser may write everywhere
        monkeypatch.setattr(os, "access", lambda path, mode: Path(path) != locked and real(path, mode))

    @pytest.mark.parametrize(
        ("words", "message"),
        [
            ("fit nca --exemplar good.png --out locked/run", "'{}/locked' is not writable"),
            ("fit nca --exemplar good.png --out good.png/run", "is a file"),
            ("fit surface --exemplar good.png --mesh good.obj --out locked", "'{}/locked' is not writable"),
            ("fit surface --exemplar good.png --tile 64 --out locked/run", "is not writable"),
            ("fit geometric --reference good.obj --out locked/run", "is not writable"),
            ("fit displacement --reference good.obj --out locked/run", "is not writable"),
            ("fit nerf --capture nothing --out locked/run", "is not writable"),
            ("fit plain_field --capture nothing --out locked/run", "is not writable"),
            ("fit quilted --texture nothing --out locked/run", "is not writable"),
            ("fit nerf --capture nothing --set stesp=3", "did you mean steps?"),
            ("fit plain_field --capture nothing --set stesp=3", "did you mean steps?"),
            ("apply pebbles --mesh good.obj --out locked/a.glb", "is not writable"),
            ("apply pebbles --mesh good.obj --out locked/maps/", "is not writable"),
            ("apply pebbles --tile 64 --out locked/tile", "is not writable"),
            ("apply spikes --mesh good.obj --out out/a.gltf", "use one of .glb"),
            ("animate spikes --mesh good.obj --out locked/a.mp4", "is not writable"),
            ("animate pebbles --mesh good.obj --out locked/a.gif", "is not writable"),
            ("animate pebbles --mesh good.obj --out locked/frames/", "is not writable"),
            ("graft pebbles lava --mesh good.obj --weights y --out locked/a.glb", "is not writable"),
            ("animate spikes --mesh good.obj --out out/a.png", "use one of .mp4, .gif"),
            ("animate spikes --mesh good.obj --out out/a.mp4 --resolution 33", "MP4 needs an even size"),
            ("animate spikes --mesh good.obj --out out/a.gif --meshes good.png", "is a file"),
            ("animate spikes --mesh good.obj --out out/a.gif --meshes locked/m", "is not writable"),
            ("render a.glb --out locked/a.png", "is not writable"),
            ("render a.glb --out a.glb", "'a.glb'"),
            ("render a.glb --out out/a.mp4 --resolution 33", "MP4 needs an even size"),
            ("demo --out locked/demo", "is not writable"),
            ("demo --out good.png", "is a file"),
        ],
    )
    def test_it_is_refused(self, files, words, message, capsys):
        bad.image(files / "good.png")
        bad.text(files / "a.glb")
        check_refused(files, words.split(), message.format(files), capsys)

    def test_a_folder_in_the_way_of_the_demo(self, files, capsys):
        (files / "out" / "knot.glb").mkdir()
        check_refused(files, ["demo", "--out", "out"], "'out/knot.glb' is a folder", capsys)


class TestRunFolders:
    def test_other_files(self, files, capsys):
        bad.text(files / "out" / "run" / "thesis.txt")
        check_refused(files, fit(QUICK, files), "other files", capsys)

    def test_a_run_is_there_already(self, files, capsys):
        bad.safetensors(files / "out" / "run" / "checkpoint.safetensors")
        check_refused(files, fit(QUICK, files), "--resume", capsys)

    def test_resume_of_a_damaged_checkpoint(self, files, capsys):
        bad.text(files / "out" / "run" / "metrics.jsonl", '{"step": 1}\n')
        bad.text(files / "out" / "run" / "checkpoint.safetensors")
        check_refused(files, fit(f"--resume {QUICK}", files), "checkpoint", capsys)

    def test_resume_of_a_foreign_checkpoint(self, files, capsys):
        bad.text(files / "out" / "run" / "metrics.jsonl", '{"step": 1}\n')
        bad.safetensors(files / "out" / "run" / "checkpoint.safetensors")
        check_refused(files, fit(f"--resume {QUICK}", files), "checkpoint", capsys)

    def test_below_a_file(self, files, capsys):
        check_refused(files, fit(QUICK, files, out="good.obj/run"), "is a file", capsys)

    def test_is_a_file(self, files, capsys):
        check_refused(files, fit(QUICK, files, out="good.obj"), "good.obj", capsys)
