"""Finding an LLVM that Dr.Jit can compile with.

Dr.Jit opens the library when it is imported and an unsuitable one aborts the process, which Python cannot
catch. So the choice is made beforehand: by version where that settles it, else by a kernel in another
process.
"""

import glob
import json
import os
import platform
import re
import site
import subprocess
import sys
import tempfile
from collections.abc import Iterator
from contextlib import suppress
from dataclasses import asdict, dataclass
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

from mitex.errors import OutputError, RuntimeUnavailable
from mitex.paths import atomic_write, cache_dir
from mitex.runtime.signals import signal_name

VARIABLE = "DRJIT_LIBLLVM_PATH"
OLDEST = 17  # 14 is refused by Dr.Jit 1.5, 15 and 16 abort: "Cannot select: fminimum"
REMEDY = (
    "run `pip install karellen-llvm-core` (Linux x86-64) or `apt install libllvm19`, start Python again, "
    f"or set {VARIABLE} to a libLLVM of version {OLDEST} or newer"
)
SYSTEM_PATTERNS = (
    "/usr/lib/*-linux-gnu/libLLVM*.so*",
    "/usr/lib/llvm-*/lib/libLLVM*.so*",
    "/usr/lib64/libLLVM*.so*",
    "/usr/lib64/llvm*/lib*/libLLVM*.so*",
    "/usr/lib/libLLVM*.so*",
    "/usr/lib/llvm/*/lib*/libLLVM*.so*",
    "/usr/local/lib/libLLVM*.so*",
    "/opt/homebrew/opt/llvm*/lib/libLLVM*.dylib",
    "/usr/local/opt/llvm*/lib/libLLVM*.dylib",
)
PROBE_SECONDS = 120
PROBE_SCRIPT = Path(__file__).with_name("probe.py")


@dataclass(frozen=True)
class Llvm:
    """A library and where it was looked for: `user`, `environment` or `system`."""

    path: str
    origin: str


@dataclass(frozen=True)
class Verdict:
    """Whether Dr.Jit can use a library; `reason` says why not."""

    usable: bool
    version: str
    reason: str = ""


_selected: Llvm | None = None


def select_llvm() -> None:
    """Points Dr.Jit, in this process and in those it starts, at the LLVM of `find_llvm`.

    Raises:
        RuntimeUnavailable: None is usable.
    """
    global _selected
    _selected = find_llvm()[0]
    os.environ[VARIABLE] = _selected.path


def find_llvm() -> tuple[Llvm, Verdict]:
    """The first usable LLVM: the user's, else the environment's, else the newest of the system.

    The user's choice (`DRJIT_LIBLLVM_PATH`) is never replaced silently: an unusable one is an error.

    Raises:
        RuntimeUnavailable: None is usable; the message names what was found.
    """
    refusals = []
    for library in candidates():
        verdict = judge(library.path)
        if verdict.usable:
            return library, verdict
        refusals.append(f"{verdict.version or 'unknown version'} at {library.path} ({verdict.reason})")
        if library.origin == "user":
            raise RuntimeUnavailable(
                f"the LLVM that {VARIABLE} names cannot be used: {refusals[0]}",
                f"unset {VARIABLE} to let Mitex search, or: {REMEDY}",
            )
    result = "found only " + ", ".join(refusals[:6]) if refusals else "found none"
    raise RuntimeUnavailable(f"Mitsuba needs an LLVM of version {OLDEST} or newer and Mitex {result}", REMEDY)


def candidates() -> list[Llvm]:
    """Libraries in the order in which they are tried; the user's choice stands alone."""
    path = os.environ.get(VARIABLE)
    if path:
        return [_selected if _selected and _selected.path == path else Llvm(path, "user")]
    # The PyPI package puts its library beside the interpreter's other files.
    homes = dict.fromkeys([sys.prefix, site.getuserbase()])
    environment = [path for home in homes for path in _matches(f"{glob.escape(home)}/lib/libLLVM*.*")]
    system = [path for pattern in SYSTEM_PATTERNS for path in _matches(pattern)]
    ranked = [Llvm(path, "environment") for path in _newest_first(environment)]
    ranked += [Llvm(path, "system") for path in _newest_first(system)]
    first: dict[str, Llvm] = {}
    for library in ranked:
        first.setdefault(os.path.realpath(library.path), library)
    return list(first.values())


def judge(path: str) -> Verdict:
    """Whether Dr.Jit can use the library, from its name, the cache, or a probe in another process."""
    if os.sep in path and not os.path.isfile(path):
        return Verdict(False, "", "there is no such file")
    number = named_version(path)
    if number and number[0] < OLDEST:
        return Verdict(False, ".".join(map(str, number)), f"older than {OLDEST}")
    key = _cache_key(path)
    cache = _read_cache()
    if key in cache:
        return cache[key]
    verdict, lasting = probe(path)
    if key and lasting:
        _write_cache({**cache, key: verdict})
    return verdict


def named_version(path: str) -> tuple[int, ...] | None:
    """The version that a path tells: `libLLVM-14.0.6.so.1`, `libLLVM.so.19.1`, `/usr/lib/llvm-19/lib/...`."""
    for name in (os.path.basename(path), os.path.basename(os.path.realpath(path))):
        match = re.match(r"libLLVM-(\d+(?:\.\d+)*)", name) or re.match(r"libLLVM\.so\.(\d+(?:\.\d+)*)", name)
        if match:
            return tuple(int(part) for part in match[1].split("."))
    match = re.search(r"/llvm[-@]?/?(\d+)/lib", path)
    return (int(match[1]),) if match else None


def probe(path: str) -> tuple[Verdict, bool]:
    """Tries a library in another process; also says whether the answer will still hold next time.

    A library that cannot be loaded may become loadable (the PyPI package finishes its links at the next
    start of Python), so that answer does not last; neither does a time-out.
    """
    with tempfile.TemporaryDirectory() as kernels:
        # An empty kernel cache, since a kernel found there would not be compiled.
        environment = {**os.environ, "DRJIT_CACHE_DIR": kernels}
        environment["PYTHONPATH"] = os.pathsep.join(entry for entry in sys.path if entry)
        command = [sys.executable or "python3", "-P", str(PROBE_SCRIPT), path, str(OLDEST)]
        try:
            process = subprocess.run(
                command, env=environment, capture_output=True, text=True, timeout=PROBE_SECONDS, check=False
            )
        except subprocess.TimeoutExpired:
            return Verdict(False, "", f"it did not answer within {PROBE_SECONDS} seconds"), False
        except OSError as e:
            return Verdict(False, "", f"it could not be tried: {e}"), False
    return _read_probe(process)


def _read_probe(process: "subprocess.CompletedProcess[str]") -> tuple[Verdict, bool]:
    answer: dict = {}
    for line in process.stdout.splitlines():
        with suppress(ValueError):
            answer.update(json.loads(line))
    number = ".".join(map(str, answer.get("version") or ()))
    if answer.get("usable") is True:
        return Verdict(True, number), True
    if "error" in answer:
        return Verdict(False, number, answer["error"]), False
    if "version" in answer and answer["version"] is None:
        return Verdict(False, "", "older than 16"), True
    if process.returncode < 0:
        return Verdict(False, number, f"it ends the process ({signal_name(-process.returncode)})"), True
    if process.returncode == 0 and number:
        return Verdict(False, number, f"older than {OLDEST}"), True
    last = (process.stderr.strip().splitlines() or ["no message"])[-1]
    return Verdict(False, number, f"the probe failed: {last[:200]}"), False


def _matches(pattern: str) -> Iterator[str]:
    for path in glob.iglob(pattern):
        if re.search(r"\.(so|so\.[\d.]+|dylib)$", path) and os.path.isfile(path):
            yield path


def _newest_first(paths: list[str]) -> list[str]:
    return sorted(sorted(paths), key=lambda path: named_version(path) or (0,), reverse=True)


def _cache_key(path: str) -> str:
    try:
        status = os.stat(path)
        drjit = version("drjit")
    except (OSError, PackageNotFoundError):
        return ""
    real = os.path.realpath(path)
    return f"{real} {status.st_size} {status.st_mtime_ns} drjit {drjit} {platform.node()}"


def _read_cache() -> dict[str, Verdict]:
    try:
        entries = json.loads((cache_dir() / "llvm.json").read_text())
        return {str(key): Verdict(**value) for key, value in entries.items()}
    except (OSError, ValueError, TypeError, AttributeError):
        return {}


def _write_cache(verdicts: dict[str, Verdict]) -> None:
    entries = {key: asdict(verdict) for key, verdict in verdicts.items()}
    with suppress(OutputError), atomic_write(cache_dir() / "llvm.json") as temporary:
        temporary.write_text(json.dumps(entries, indent=1))
