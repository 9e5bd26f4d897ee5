"""The threads of torch, of Dr.Jit and of k-d trees: how many, and which of the first two gives way."""

import os
import sys
import time
from contextlib import suppress
from importlib import import_module
from pathlib import Path

from mitex.errors import ConfigError

THREADS = (
    "MITEX_THREADS"  # of the environment: how many threads Dr.Jit gets, as OMP_NUM_THREADS says for torch
)
WORKER_NAME = "nt ["  # what Dr.Jit calls its worker threads, with a number
WORKER_NICENESS = 10  # added to the process's when they are to give way
WORKER_IDLE_TIME = 0.05  # after which they sleep [s]
MANY = 2000  # points that a tree is asked for in threads, which take milliseconds to begin

_threads: int | None = None


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


def is_set() -> bool:
    """Whether `threads` has been called."""
    return _threads is not None


def allowed() -> int | None:
    """How many threads there may be, as `threads` or MITEX_THREADS of the environment says; None for any."""
    text = os.environ.get(THREADS, "")
    return _threads or (int(text) if text.isdecimal() else 0) or None


def tree_threads(points: int) -> int:
    """How many threads SciPy's k-d trees get for a number of points, as their argument `workers`."""
    return (allowed() or -1) if points >= MANY else 1


def apply_thread_count() -> None:
    """Gives Dr.Jit, once it is loaded, the threads that are `allowed`."""
    count = allowed()
    if count and count != import_module("drjit").thread_count():
        set_workers(count)


def let_idle_threads_sleep() -> None:
    """Lets torch's idle threads sleep, where they would spin on cores that Dr.Jit works on.

    For what goes to and fro between the two, as `nerf` does, whose training takes three quarters of the time,
    and `nca`: finding where a view's points lie takes 10 ms instead of 240. Work that is mostly torch's gets
    slower: `surface` by a fifth or far more.
    To be called before torch is imported, later it has no effect; OMP_WAIT_POLICY has precedence.
    """
    os.environ.setdefault("OMP_WAIT_POLICY", "PASSIVE")


def use_one_blas_thread() -> None:
    """Lets OpenBLAS, which NumPy and SciPy multiply with, use one thread.

    Its threads spin until all have done their part of a product. A sparse factorisation has many small
    products: beside another program on two cores, one of 165,199 unknowns took 206 s instead of 5. Alone it
    gains nothing from a second thread. Large products are torch's here.
    To be called before NumPy is imported, later it has no effect; OPENBLAS_NUM_THREADS and OMP_NUM_THREADS
    have precedence.
    """
    if "OMP_NUM_THREADS" not in os.environ:
        os.environ.setdefault("OPENBLAS_NUM_THREADS", "1")


def lower_worker_priority() -> None:
    """Lets torch go before Dr.Jit's workers where both want a core (on Linux; elsewhere nothing happens).

    Workers spin for 20 ms after each kernel; on two cores, torch's products then take one and a half times as
    long. At a lower priority workers take only what is free. This is for work in which torch's idle threads
    sleep (`let_idle_threads_sleep`): beside threads that spin, kernels would starve. Ending the workers while
    torch works would be as fast, but see `set_workers`.
    """
    drjit = import_module("drjit")
    drjit.set_thread_count(drjit.thread_count())  # begins them if no kernel has run yet
    for name in Path("/proc/self/task").glob("*/comm"):
        with suppress(OSError):  # a thread that ends meanwhile
            if name.read_text().startswith(WORKER_NAME):
                os.setpriority(os.PRIO_PROCESS, int(name.parent.name), os.nice(0) + WORKER_NICENESS)


def set_workers(count: int) -> None:
    """Lets Dr.Jit use `count` threads.

    A worker that is told to end just as it falls asleep may miss that, and is waited for forever (nanothread
    of Dr.Jit 1.5). New ones sleep at once, others 20 ms after a kernel: they do so before any is ended.
    """
    drjit = import_module("drjit")
    if count < drjit.thread_count():
        time.sleep(WORKER_IDLE_TIME)
    drjit.set_thread_count(count)
