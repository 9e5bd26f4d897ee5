"""Starting Mitsuba in this process: LLVM first, then the variant, then the plugins."""

import os
import random
import sys
import time
from contextlib import suppress
from importlib import import_module
from pathlib import Path
from typing import TYPE_CHECKING, Any

from mitex.errors import ConfigError, RuntimeUnavailable
from mitex.runtime import llvm

if TYPE_CHECKING:
    import torch

DEFAULT_VARIANT = "llvm_ad_rgb"
WORKER = "nt ["  # what Dr.Jit calls its worker threads, with a number
MODEST = 10  # how much nicer they are than torch
RESTED = 0.05  # after which they rest [s]

_threads: int | None = None


def init(variant: str = DEFAULT_VARIANT) -> Any:
    """Makes Mitsuba ready and returns the module `mitsuba`; cheap to call again.

    A variant that has been set already stays; use `mitsuba.set_variant` to change it. Plugins of Mitex
    are registered for the variant in use and for every later one.

    Args:
        variant: The variant to set when none is set.

    Raises:
        ConfigError: This Mitsuba has no such variant.
        RuntimeUnavailable: Mitsuba is not installed, or the variant needs LLVM and none is usable.
    """
    loaded = sys.modules.get("mitsuba")
    wanted = (loaded.variant() if loaded else None) or variant
    mi = load_mitsuba(needs_llvm=wanted.startswith("llvm"))
    if wanted not in mi.variants():
        names = ", ".join(mi.variants())
        raise ConfigError(f"Mitsuba has no variant '{wanted}'", f"choose one of {names}")
    import_module("mitex.plugins")
    if mi.variant() is None:
        try:
            mi.set_variant(wanted)
        except ImportError as e:
            raise RuntimeUnavailable(
                f"Mitsuba cannot start '{wanted}' ({e})", "choose another variant or run `mitex doctor`"
            ) from e
    return mi


def load_mitsuba(needs_llvm: bool = True) -> Any:
    """Imports Mitsuba with a usable LLVM, sets no variant, and returns the module.

    Args:
        needs_llvm: Whether the lack of a usable LLVM is an error; scalar and CUDA variants do without.

    Raises:
        RuntimeUnavailable: Mitsuba cannot be imported, or LLVM is needed and none is usable.
    """
    if "drjit" not in sys.modules:
        try:
            llvm.select_llvm()
        except RuntimeUnavailable:
            if needs_llvm:
                raise
    try:
        mi = import_module("mitsuba")
        dr = import_module("drjit")
    except ImportError as e:
        raise RuntimeUnavailable(
            f"Mitsuba cannot be imported ({e})", "run `pip install 'mitsuba>=3.9,<3.10'` in this environment"
        ) from e
    if needs_llvm:
        _check_loaded_llvm(dr)
    if _threads not in (None, dr.thread_count()):
        set_workers(_threads)
    return mi


def _check_loaded_llvm(dr: Any) -> None:
    """Refuses what Dr.Jit has opened, before a kernel is compiled with it: that would end the process."""
    major, minor, patch = dr.detail.llvm_version()
    if major >= llvm.OLDEST:
        return
    what = f"with LLVM {major}.{minor}.{patch}, which is too old" if major >= 0 else "without a usable LLVM"
    remedy = f"call `mitex.init()` before the first import of mitsuba or drjit, or set {llvm.VARIABLE}"
    try:
        library, verdict = llvm.find_llvm()
        remedy += f"={library.path} (LLVM {verdict.version}) before starting Python"
    except RuntimeUnavailable:
        remedy = llvm.REMEDY
    raise RuntimeUnavailable(f"Dr.Jit was loaded {what}", remedy)


def threads(count: int) -> None:
    """Lets torch and Dr.Jit use `count` threads each; with one thread results are bit-identical.

    Raises:
        ConfigError: `count` is below 1.
    """
    global _threads
    if count < 1:
        raise ConfigError(f"{count} threads cannot work", "use at least 1")
    _threads = count
    import_module("torch").set_num_threads(count)
    if "drjit" in sys.modules:
        set_workers(count)


def yield_cores() -> None:
    """Lets torch's idle threads sleep, where they would spin on cores that Dr.Jit works on.

    For what goes to and fro between the two, as `nerf` does: its training takes three quarters of the time.
    Work that is mostly torch's gets slower: `nca` by a tenth to a fifth, `surface` by a fifth or far more.
    To be called before torch is imported, later it has no effect; OMP_WAIT_POLICY has precedence.
    """
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")


def modest_workers() -> None:
    """Lets torch go before Dr.Jit's workers where both want a core (on Linux; elsewhere nothing happens).

    They spin for 20 ms after each kernel, and torch's products on two cores take half as long again. At a
    lower priority they take what is free. For work in which torch's idle threads sleep (`yield_cores`):
    beside threads that spin kernels would starve. To end workers while torch works is as fast, but see
    `set_workers`.
    """
    drjit = import_module("drjit")
    drjit.set_thread_count(drjit.thread_count())  # begins them if no kernel has run yet
    for name in Path("/proc/self/task").glob("*/comm"):
        with suppress(OSError):  # a thread that ends meanwhile
            if name.read_text().startswith(WORKER):
                os.setpriority(os.PRIO_PROCESS, int(name.parent.name), os.nice(0) + MODEST)


def set_workers(count: int) -> None:
    """Lets Dr.Jit use `count` threads.

    A worker that is told to end just as it goes to rest may miss that, and is waited for forever (nanothread
    of Dr.Jit 1.5). New ones rest at once, others 20 ms after a kernel: they have done so before any is ended.
    """
    drjit = import_module("drjit")
    if count < drjit.thread_count():
        time.sleep(RESTED)
    drjit.set_thread_count(count)


def seed_everything(seed: int) -> "torch.Generator":
    """Seeds Python's, NumPy's and torch's global generators and returns an own CPU generator with that seed.

    Raises:
        ConfigError: `seed` is not in [0, 2**32).
    """
    if not 0 <= seed < 2**32:
        raise ConfigError(f"seed {seed} is out of range", "use a whole number from 0 to 4294967295")
    torch = import_module("torch")
    random.seed(seed)
    import_module("numpy").random.seed(seed)
    torch.manual_seed(seed)
    return torch.Generator().manual_seed(seed)
