"""A job's process: its memory."""

import signal

import pytest

from mitex.batch import process
from mitex.batch.jobs import jobs_of
from mitex.batch.process import Process, environment

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
