"""Claims: one holder at a time, whoever dies, wherever."""

import errno
import os
import shutil
import socket
import subprocess
import sys
import time
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import pytest

from mitex.batch import claims
from mitex.batch.claims import STALE_AFTER, Claim, holder

HOST, SPACE = socket.gethostname(), claims._space()
ELSEWHERE = "elsewhere:1:0:there/2\n"

# Takes the claim on a folder, and keeps it until its input ends.
HOLD = """
import sys
from pathlib import Path
from mitex.batch.claims import Claim
assert Claim.take(Path(sys.argv[1]))
print("taken", flush=True)
sys.stdin.read()
"""
# A command in a PID namespace of its own, in which it has a certain number.
CONTAINED = ["unshare", "--user", "--map-root-user", "--pid", "--fork", "--mount-proc", "sh", "-ec"]
NUMBERED = 'echo $(($1 - 1)) > /proc/sys/kernel/ns_last_pid; shift; "$@"; true'


def line(pid, moment=None, space=SPACE):
    """Of a claim on this host."""
    return f"{HOST}:{pid}:{time.time() if moment is None else moment}:{space}\n"


def claimed(folder, line, number=0, age=0.0):
    """A claim that another process has left."""
    path = folder / f"claim.{number}"
    path.write_text(line)
    moment = time.time() - age
    os.utime(path, (moment, moment))
    return path


def taken(folder) -> Claim:
    claim = Claim.take(folder)
    assert claim
    return claim


@pytest.fixture(scope="module")
def dead():
    """The number of a process that has ended."""
    process = subprocess.Popen([sys.executable, "-c", ""])
    process.wait()
    return process.pid


class TestOneHolder:
    def test_the_second_gets_none_until_the_first_lets_go(self, tmp_path):
        assert holder(tmp_path) is None
        with taken(tmp_path) as claim:
            assert Claim.take(tmp_path) is None and holder(tmp_path) == HOST
            host, pid, moment, space = claim.path.read_text().strip().split(":")
            assert (host, int(pid), space) == (HOST, os.getpid(), SPACE)
            assert abs(float(moment) - time.time()) < 60
        assert holder(tmp_path) is None and not list(tmp_path.iterdir())
        assert Claim.take(tmp_path)

    @pytest.mark.parametrize("stale", [False, True])
    def test_of_many_at_once(self, stale, tmp_path, dead):
        """Each of eight threads takes claims over and over; never do two hold one."""
        holders, most, ends = [], [], time.monotonic() + 1.0

        def work():
            while time.monotonic() < ends:
                if claim := Claim.take(tmp_path):
                    holders.append(claim)
                    most.append(len(holders))
                    time.sleep(0.001)
                    holders.remove(claim)
                    if stale:  # as one whose process has died
                        claim.path.write_text(line(dead))
                    else:
                        claim.release()

        with ThreadPoolExecutor(8) as pool:
            for done in [pool.submit(work) for _ in range(8)]:
                done.result()
        assert len(most) > 10 and max(most) == 1


class TestStaleOnes:
    def test_of_a_process_that_ended(self, tmp_path, dead):
        claimed(tmp_path, line(dead))
        assert holder(tmp_path) is None and Claim.take(tmp_path)
        assert [path.name for path in tmp_path.iterdir()] == ["claim.1"]

    def test_not_while_its_job_s_process_lives_on(self, tmp_path, dead):
        claimed(tmp_path, line(dead) + line(os.getpid()), age=1e6)
        assert Claim.take(tmp_path) is None

    def test_of_a_number_that_another_process_has_now(self, tmp_path):
        claimed(tmp_path, line(os.getpid(), time.time() - 1e6))
        assert Claim.take(tmp_path)

    @pytest.mark.parametrize(("age", "free"), [(0.5 * STALE_AFTER, False), (2 * STALE_AFTER, True)])
    def test_of_another_host_by_its_age(self, age, free, tmp_path):
        claimed(tmp_path, ELSEWHERE, age=age)
        assert (holder(tmp_path) is None) == free == bool(Claim.take(tmp_path))

    @pytest.mark.parametrize("part", ["boot", "namespace"])
    @pytest.mark.parametrize(("age", "free"), [(0.5 * STALE_AFTER, False), (2 * STALE_AFTER, True)])
    def test_of_another_space_by_its_age(self, age, free, part, tmp_path, dead):
        """In which the number of a process that has ended here, or lives, means another one."""
        boot, _, namespace = SPACE.partition("/")
        space = f"another/{namespace}" if part == "boot" else f"{boot}/1"
        claimed(tmp_path, line(os.getpid() if free else dead, space=space), age=age)
        assert (holder(tmp_path) is None) == free == bool(Claim.take(tmp_path))

    def test_half_a_line_counts_by_its_age(self, tmp_path):
        claimed(tmp_path, f"{HOST}:12")
        assert Claim.take(tmp_path) is None
        claimed(tmp_path, "", age=2 * STALE_AFTER)
        assert Claim.take(tmp_path)

    @pytest.mark.parametrize("number", [errno.ESTALE, errno.EIO])
    def test_not_one_of_which_the_disk_says_nothing(self, number, tmp_path, monkeypatch):
        path, real = claimed(tmp_path, ELSEWHERE, age=1e6), Path.stat

        def stat(place, **options):
            if place == path:
                raise OSError(number, os.strerror(number))
            return real(place, **options)

        monkeypatch.setattr(Path, "stat", stat)
        assert Claim.take(tmp_path) is None

    def test_by_the_clock_of_the_file_system(self, tmp_path, monkeypatch):
        claimed(tmp_path, ELSEWHERE)
        monkeypatch.setattr(time, "time", lambda: 1e6)
        assert Claim.take(tmp_path) is None


def test_a_container_of_the_same_name_holds_a_claim(tmp_path, dead):
    """By a process whose number is nobody's outside."""
    command = [*CONTAINED, NUMBERED, "sh", str(dead)]
    if not shutil.which("unshare") or subprocess.run([*command, "true"], capture_output=True).returncode:
        pytest.skip("no PID namespace can be made here")
    command += [sys.executable, "-c", HOLD, str(tmp_path)]
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.PIPE) as process:
        assert process.stdout and process.stdin and process.stdout.readline() == b"taken\n"
        assert claims._read(tmp_path / "claim.0")[0].pid == dead
        assert Claim.take(tmp_path) is None and holder(tmp_path) == HOST
        process.stdin.close()


def test_a_holder_sees_that_it_was_taken_over(tmp_path, monkeypatch):
    """As after a night of a laptop's sleep."""
    first = taken(tmp_path)
    assert first.touch()
    first.path.write_text(ELSEWHERE)
    os.utime(first.path, (0, 0))
    assert Claim.take(tmp_path) and not first.touch()


def test_a_job_s_process_is_noted(tmp_path):
    claim = taken(tmp_path)
    claim.note(12)
    assert [entry[1] for entry in claims._read(claim.path)] == [os.getpid(), 12]


def test_touching_keeps_a_claim_young(tmp_path):
    claim = taken(tmp_path)
    os.utime(claim.path, (0, 0))
    claim.touch()
    assert time.time() - claim.path.stat().st_mtime < STALE_AFTER
