"""A job's process: its memory, and its environment."""

import os
import signal
import tempfile
from pathlib import Path

import pytest

from mitex.batch import process
from mitex.batch.jobs import jobs_of
from mitex.batch.process import KERNELS, THREAD_VARIABLES, Process, environment

MB = 1 << 20


@pytest.fixture
def memory(workshop):
    """Exit code and memory [MB] of a fit whose exemplar has a content."""

    def memory(content):
        (workshop.folder / "a.png").write_text(content)
        job = jobs_of(workshop.plan(("a.png",)))[0]
        with (workshop.folder / "log.txt").open("wb") as log:
            code, peak = Process(job.words, workshop.folder, log, environment(1)).wait()
        return code, peak / MB

    return memory


class TestMemory:
    def test_is_not_that_of_the_process_that_started_it(self, memory):
        ballast = bytearray(400 * MB)
        code, peak = memory("")
        assert code == 0 and 10 < peak < 200, len(ballast)

    def test_counts_processes_that_it_starts(self, memory):
        code, peak = memory("helper")
        assert code == 0 and 300 < peak < 400

    @pytest.mark.parametrize(("own", "known"), [(0, True), (1 << 50, False)])
    def test_of_a_killed_one_is_known_if_it_had_more(self, own, known, memory, monkeypatch):
        monkeypatch.setattr(process, "own_peak", lambda: own)
        code, peak = memory("crash")
        assert code == -signal.SIGKILL and (peak > 10 if known else peak == 0)


class TestEnvironment:
    @pytest.fixture(autouse=True)
    def temporary(self, tmp_path, monkeypatch):
        """A disk of the machine's own."""
        monkeypatch.setattr(tempfile, "tempdir", str(tmp_path))
        monkeypatch.delenv(KERNELS, raising=False)
        return tmp_path

    def told(self, workshop):
        """The variables of a job, as it tells them: those of threads, and where kernels are kept."""
        workshop.run(workshop.plan(("a.png",)))
        return workshop.log.read_text().splitlines()[0].split()[2:]

    def test_of_a_job(self, workshop, temporary, monkeypatch):
        for name in THREAD_VARIABLES:
            monkeypatch.setenv(name, "64")
        kernels = temporary / f"mitex-{os.getuid()}" / "drjit"
        assert self.told(workshop) == ["1", "1", "1", "1", str(kernels)]
        assert kernels.is_dir() and not kernels.parent.stat().st_mode & 0o077

    def test_every_library_has_its_threads(self):
        variables = environment(3)
        names = ("MITEX_THREADS", "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
        assert [variables[name] for name in names] == ["3"] * 4

    def test_the_user_s_own_place_of_kernels(self, monkeypatch):
        monkeypatch.setenv("DRJIT_CACHE_DIR", "/somewhere")
        assert environment(1)["DRJIT_CACHE_DIR"] == "/somewhere"

    def test_no_kernels_where_others_can_write(self, temporary):
        place = temporary / f"mitex-{os.getuid()}"
        place.mkdir()
        place.chmod(0o777)
        assert "DRJIT_CACHE_DIR" not in environment(1)

    def test_modules_of_the_folder_are_there_in_another_one(self, monkeypatch):
        monkeypatch.setenv("PYTHONPATH", os.pathsep.join(["lib", "", "/opt/lib"]))
        assert environment(1)["PYTHONPATH"].split(os.pathsep) == [str(Path("lib").absolute()), "/opt/lib"]
