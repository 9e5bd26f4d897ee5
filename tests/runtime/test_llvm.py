"""Choosing an LLVM: order, refusals, the probe in another process, and its cache."""

import ctypes.util
import os
import site
import sys
from pathlib import Path

import pytest

from mitex.errors import RuntimeUnavailable
from mitex.runtime import llvm

ABORTS = "import os, sys; print('{\"version\": [%d, 0, 0]}', flush=True); os.abort()"
WORKS = "print('{\"version\": [21, 1, 0]}'); print('{\"usable\": true}')"


@pytest.fixture
def sandbox(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A machine without any LLVM: `env` is its Python environment, `lib` its system libraries."""
    monkeypatch.delenv(llvm.VARIABLE, raising=False)
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(sys, "prefix", str(tmp_path / "env"))
    monkeypatch.setattr(site, "getuserbase", lambda: str(tmp_path / "user"))
    monkeypatch.setattr(
        llvm, "SYSTEM_PATTERNS", (f"{tmp_path}/lib/libLLVM*.so*", f"{tmp_path}/llvm-*/lib/*.so*")
    )
    return tmp_path


def library(path: Path) -> str:
    path.parent.mkdir(parents=True, exist_ok=True)
    path.write_text("not a shared library")
    return str(path)


def use_probe(monkeypatch: pytest.MonkeyPatch, folder: Path, code: str) -> None:
    script = folder / "stub_probe.py"
    script.write_text(code)
    monkeypatch.setattr(llvm, "PROBE_SCRIPT", script)


def forbid_probe(monkeypatch: pytest.MonkeyPatch) -> None:
    def probe(path: str) -> None:
        raise AssertionError(f"{path} was probed")

    monkeypatch.setattr(llvm, "probe", probe)


@pytest.mark.parametrize(
    ("path", "version"),
    [
        ("/usr/lib/x86_64-linux-gnu/libLLVM-14.so.1", (14,)),
        ("/usr/lib/x86_64-linux-gnu/libLLVM-14.0.6.so.1", (14, 0, 6)),
        ("/usr/lib/x86_64-linux-gnu/libLLVM.so.19.1", (19, 1)),
        ("/nowhere/lib/libLLVM-23.so", (23,)),
        ("/usr/lib/llvm-18/lib/libLLVM.so", (18,)),
        ("/opt/homebrew/opt/llvm@20/lib/libLLVM.dylib", (20,)),
        ("/nowhere/lib/libLLVM.so", None),
        ("/nowhere/lib/libLLVM.so.1", (1,)),
    ],
)
def test_version_is_read_from_the_name(path: str, version: tuple[int, ...] | None):
    assert llvm.named_version(path) == version


def test_environment_comes_before_the_system_newest_first_without_repetition(sandbox: Path):
    old = library(sandbox / "lib/libLLVM-15.so.1")
    nine = library(sandbox / "lib/libLLVM.so.19.1")
    (sandbox / "lib/libLLVM-19.so").symlink_to(nine)
    unknown = library(sandbox / "lib/libLLVM.so")
    folder = library(sandbox / "llvm-100/lib/libLLVM.so")
    own = library(sandbox / "env/lib/libLLVM.so.18.1")
    library(sandbox / "env/lib/libLLVM.txt")
    order = [(item.origin, os.path.realpath(item.path)) for item in llvm.candidates()]
    system = [("system", path) for path in (folder, nine, old, unknown)]
    assert order == [("environment", own), *system]


def test_users_choice_stands_alone(sandbox: Path, monkeypatch: pytest.MonkeyPatch):
    library(sandbox / "env/lib/libLLVM.so.23.1")
    monkeypatch.setenv(llvm.VARIABLE, "/my/libLLVM.so")
    assert llvm.candidates() == [llvm.Llvm("/my/libLLVM.so", "user")]
    with pytest.raises(RuntimeUnavailable, match="/my/libLLVM.so.*no such file.*unset DRJIT_LIBLLVM_PATH"):
        llvm.find_llvm()


@pytest.mark.parametrize("name", ["libLLVM-14.so.1", "libLLVM-15.so", "libLLVM.so.16.0"])
def test_known_bad_versions_are_refused_without_trying(sandbox: Path, monkeypatch, name: str):
    forbid_probe(monkeypatch)
    verdict = llvm.judge(library(sandbox / "lib" / name))
    assert not verdict.usable and verdict.reason == "older than 17"


def test_error_names_everything_found_and_the_remedy(sandbox: Path):
    first, second = library(sandbox / "lib/libLLVM-14.so.1"), library(sandbox / "lib/libLLVM-15.so.1")
    with pytest.raises(RuntimeUnavailable) as error:
        llvm.find_llvm()
    text = str(error.value)
    assert first in text and second in text and "14" in text and "older than 17" in text
    assert "karellen-llvm-core" in text and "libllvm19" in text and "\n" not in text


def test_error_without_any_library(sandbox: Path):
    with pytest.raises(RuntimeUnavailable, match="found none; run `pip install"):
        llvm.find_llvm()


def test_a_file_that_is_no_library_is_refused_but_not_for_ever(sandbox: Path):
    path = library(sandbox / "lib/libLLVM.so")
    verdict = llvm.judge(path)
    assert not verdict.usable and "cannot be loaded" in verdict.reason
    assert not (sandbox / "cache").exists()


def test_a_library_that_is_not_llvm_is_refused(sandbox: Path):
    other = ctypes.util.find_library("m")
    if other is None:
        pytest.skip("no maths library to try")
    verdict = llvm.judge(other)
    assert not verdict.usable and "not an LLVM library" in verdict.reason


def test_a_library_that_aborts_is_refused_and_remembered(sandbox: Path, monkeypatch: pytest.MonkeyPatch):
    use_probe(monkeypatch, sandbox, ABORTS % 18)
    path = library(sandbox / "lib/libLLVM.so")
    verdict = llvm.judge(path)
    assert verdict == llvm.Verdict(False, "18.0.0", "it ends the process (SIGABRT)")
    forbid_probe(monkeypatch)
    assert llvm.judge(path) == verdict


def test_the_next_library_is_taken_when_one_aborts(sandbox: Path, monkeypatch: pytest.MonkeyPatch):
    bad, good = library(sandbox / "lib/libLLVM.so.25.0"), library(sandbox / "lib/libLLVM.so.21.1")
    code = f"import sys\nif sys.argv[1] == {bad!r}:\n    {ABORTS % 25}\n{WORKS}"
    use_probe(monkeypatch, sandbox, code)
    assert llvm.find_llvm() == (llvm.Llvm(good, "system"), llvm.Verdict(True, "21.1.0"))


def test_cache_is_keyed_by_the_file(sandbox: Path, monkeypatch: pytest.MonkeyPatch):
    use_probe(monkeypatch, sandbox, WORKS)
    path = library(sandbox / "lib/libLLVM.so.21.1")
    assert llvm.judge(path).usable
    use_probe(monkeypatch, sandbox, ABORTS % 21)
    assert llvm.judge(path).usable
    os.utime(path, (1, 1))
    assert not llvm.judge(path).usable


@pytest.mark.parametrize("content", ["", "[]", "{", '{"key": 3}', '{"key": {"usable": true}}'])
def test_a_damaged_cache_is_ignored(sandbox: Path, monkeypatch: pytest.MonkeyPatch, content: str):
    use_probe(monkeypatch, sandbox, WORKS)
    cache = sandbox / "cache/mitex/llvm.json"
    cache.parent.mkdir(parents=True)
    cache.write_text(content)
    assert llvm.judge(library(sandbox / "lib/libLLVM.so")).usable


def test_a_cache_that_cannot_be_written_is_no_failure(sandbox: Path, monkeypatch: pytest.MonkeyPatch):
    use_probe(monkeypatch, sandbox, WORKS)
    (sandbox / "cache").write_text("a file where the folder should be")
    assert llvm.judge(library(sandbox / "lib/libLLVM.so")).usable


def test_a_probe_that_hangs_is_given_up_and_not_remembered(sandbox: Path, monkeypatch: pytest.MonkeyPatch):
    use_probe(monkeypatch, sandbox, "import time; time.sleep(600)")
    monkeypatch.setattr(llvm, "PROBE_SECONDS", 0.3)
    path = library(sandbox / "lib/libLLVM.so")
    assert "did not answer" in llvm.judge(path).reason
    use_probe(monkeypatch, sandbox, WORKS)
    monkeypatch.setattr(llvm, "PROBE_SECONDS", 60)
    assert llvm.judge(path).usable


def test_a_probe_that_fails_otherwise_tells_its_last_words(sandbox: Path, monkeypatch: pytest.MonkeyPatch):
    use_probe(monkeypatch, sandbox, "raise SystemError('out of luck')")
    assert "out of luck" in llvm.judge(library(sandbox / "lib/libLLVM.so")).reason


def test_this_machine_has_a_usable_llvm(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """The real probe with a real library and an empty cache."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    _, verdict = llvm.find_llvm()
    assert verdict.usable and int(verdict.version.split(".")[0]) >= llvm.OLDEST
    assert (tmp_path / "mitex" / "llvm.json").is_file()


def test_real_old_libraries_are_refused_by_the_probe_too(tmp_path: Path, monkeypatch: pytest.MonkeyPatch):
    """Where the name tells nothing, the probe itself has to find out."""
    old = [path for path in Path("/usr/lib/x86_64-linux-gnu").glob("libLLVM-1[4-6].so.1")]
    if not old:
        pytest.skip("no LLVM of version 14 to 16 on this machine")
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path / "cache"))
    monkeypatch.setattr(llvm, "named_version", lambda path: None)
    for path in old:
        verdict = llvm.judge(str(path))
        assert not verdict.usable and verdict.reason.startswith("older than")
