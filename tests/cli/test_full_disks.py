"""Full disks and real processes: refused like all else, with nothing half-written."""

import errno
import os
import resource
import subprocess
import sys
from pathlib import Path

import pytest

from mitex.cli import main
from tests.cli import bad_files as bad
from tests.cli.refusals import QUICK, ROOT, apply, check_complaint, check_refused, fit, program, tree


class TestFullDisks:
    """When data is flushed, when a file is renamed, or when it is opened."""

    @pytest.fixture
    def fill(self, monkeypatch):
        def refuse(*arguments, **_):
            raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC), *map(str, arguments[:1]))

        def open_refused(path, mode="r", *rest, **options):
            return (refuse if set(mode) & set("wax+") else real)(path, mode, *rest, **options)

        def fill(moment):
            if moment == "open":
                monkeypatch.setattr(Path, "open", open_refused)
            monkeypatch.setattr(os, "fsync" if moment == "open" else moment, refuse)

        real = Path.open
        return fill

    @pytest.mark.parametrize("moment", ["fsync", "replace", "open"])
    @pytest.mark.parametrize("suffix", [".glb", ".obj", ".ply", ".exr"])
    def test_apply(self, files, fill, moment, suffix, capsys):
        bad.model(files / "m.safetensors")
        words = apply("--subdivide 0 --steps 1", model="m.safetensors", out=f"out/new/a{suffix}")
        if suffix in (".glb", ".obj"):
            words += ["--resolution", "64"]
        fill(moment)
        check_refused(files, words, "space", capsys)

    def test_apply_keeps_the_old_file(self, files, fill, capsys):
        bad.model(files / "m.safetensors")
        bad.text(files / "out" / "a.glb", "old")
        fill("fsync")
        words = apply("--subdivide 0 --steps 1 --vertex-colours", model="m.safetensors")
        check_refused(files, words, "space", capsys)
        assert (files / "out" / "a.glb").read_text() == "old"

    @pytest.mark.parametrize("moment", ["fsync", "replace"])
    def test_fit_at_the_start(self, files, fill, moment, capsys):
        words = fit(QUICK, files)
        fill(moment)
        check_refused(files, words, "space", capsys)

    @pytest.mark.parametrize(
        ("moment", "name"), [("fsync", "a.png"), ("replace", "a.exr"), ("fsync", "a.gif")]
    )
    def test_render(self, files, fill, moment, name, capsys):
        bad.model(files / "m.safetensors")
        assert main(apply("--subdivide 0 --steps 1 --vertex-colours", model="m.safetensors")) == 0
        capsys.readouterr()
        words = f"render out/a.glb --out out/{name} --resolution 16 --spp 1".split()
        fill(moment)
        check_refused(files, words + ["--frames", "2"] * name.endswith("gif"), "space", capsys)


class TestInProcesses:
    """The same through the real program."""

    @pytest.mark.parametrize(
        ("words", "message"),
        [
            ("fit nca --exemplar huge.png", "over the limit"),
            ("apply pebbles --mesh no.obj --out out/a.glb", "no.obj"),
            ("render text.glb --out out/a.png", "text.glb"),
        ],
    )
    def test_the_program(self, files, words, message):
        bad.huge_png(files / "huge.png")
        bad.text(files / "text.glb")
        before = tree(files)
        done = program(f"{words} --quiet")
        assert done.returncode == 2, done.stderr
        assert done.stderr.count("\n") == 1 and done.stderr.startswith("error: ") and message in done.stderr
        assert not done.stdout and tree(files) == before

    def test_a_file_that_may_not_grow(self, files):
        """The kernel itself refuses the write in the middle of the file."""
        bad.model(files / "m.safetensors")
        before = tree(files)
        limit = (2000, 2000)
        done = program(
            "apply m.safetensors --mesh good.obj --subdivide 2 --keep-dense --steps 1 --out out/a.ply "
            "--quiet",
            preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_FSIZE, limit),
        )
        assert done.returncode == 2, done.stderr
        check_complaint(done.stdout, done.stderr, "could not write")
        assert tree(files) == before

    def test_a_huge_header_fits_in_little_memory(self, files):
        """One gigabyte of address space would not hold the 7.5 GB of pixels."""
        bad.huge_png(files / "huge.png")
        limit = (2**30, 2**30)
        done = program(
            "fit nca --exemplar huge.png", preexec_fn=lambda: resource.setrlimit(resource.RLIMIT_AS, limit)
        )
        assert (done.returncode, "over the limit" in done.stderr) == (2, True), done.stderr


class TestSignals:
    def test_sigterm_ends_an_apply_as_ctrl_c_does(self, files):
        """Outside a training loop, in the middle of the work: nothing is left, and the exit code is 130."""
        bad.model(files / "m.safetensors")
        before = tree(files)
        words = "-m mitex apply m.safetensors --mesh good.obj --subdivide 5 --steps 2000 --out out/new/a.glb"
        environment = os.environ | {"OMP_NUM_THREADS": "1", "PYTHONPATH": str(ROOT), "PYTHONUNBUFFERED": "1"}
        process = subprocess.Popen(
            [sys.executable, *words.split()], env=environment, stderr=subprocess.PIPE, text=True
        )
        assert process.stderr is not None
        process.stderr.readline()  # its first line of progress: it is at work
        process.terminate()
        _, rest = process.communicate(timeout=120)
        assert (process.returncode, rest.splitlines()[-1]) == (130, "interrupted"), rest
        assert tree(files) == before
