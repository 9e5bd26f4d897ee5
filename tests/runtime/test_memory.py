"""Freed memory stays with the process."""

import os
import subprocess
import sys

import pytest

from mitex.runtime import keep_freed_memory, memory

GLIBC = memory._is_glibc()

# Page faults of twenty allocations of 64 MB, each filled and freed.
PROGRAM = """
import ctypes, resource, sys
from mitex.runtime import keep_freed_memory
said = [keep_freed_memory(), keep_freed_memory()] if sys.argv[1] == "keep" else []
libc = ctypes.CDLL(None)
libc.malloc.restype = ctypes.c_void_p
libc.free.argtypes = [ctypes.c_void_p]
libc.memset.argtypes = [ctypes.c_void_p, ctypes.c_int, ctypes.c_size_t]
def use():
    block = libc.malloc(64 << 20)
    libc.memset(block, 1, 64 << 20)
    libc.free(block)
use()
before = resource.getrusage(resource.RUSAGE_SELF).ru_minflt
for _ in range(20):
    use()
print(said, resource.getrusage(resource.RUSAGE_SELF).ru_minflt - before)
"""


def _run(mode, **variables):
    clean = {k: v for k, v in os.environ.items() if not k.startswith("MALLOC_") and k != "GLIBC_TUNABLES"}
    command = [sys.executable, "-c", PROGRAM, mode]
    result = subprocess.run(command, env=clean | variables, capture_output=True, text=True, check=True)
    answers, faults = result.stdout.rsplit(maxsplit=1)
    return answers, int(faults)


@pytest.mark.skipif(not GLIBC, reason="glibc only")
def test_memory_is_not_asked_for_again():
    _, usual = _run("leave")
    answers, faults = _run("keep")
    assert answers == "[True, True]"
    assert faults < usual / 5


@pytest.mark.skipif(not GLIBC, reason="glibc only")
@pytest.mark.parametrize(
    "variables",
    [{"MALLOC_TRIM_THRESHOLD_": "131072"}, {"GLIBC_TUNABLES": "glibc.malloc.mmap_threshold=131072"}],
)
def test_the_user_decides(variables):
    answers, faults = _run("keep", **variables)
    assert answers == "[False, False]"
    assert faults > 20 * 16


def test_other_systems_are_left_alone(monkeypatch):
    for name in [name for name in os.environ if name.startswith("MALLOC_")]:
        monkeypatch.delenv(name)
    monkeypatch.setattr(memory, "_is_glibc", lambda: False)
    assert keep_freed_memory.__wrapped__() is False


def test_systems_without_the_question(monkeypatch):
    def refuse(name):
        raise ValueError(name)

    monkeypatch.setattr(memory.os, "confstr", refuse)
    assert not memory._is_glibc()
