"""What Mitex runs on: LLVM, Mitsuba and its variant, threads, seeds, number formats, and their report."""

from mitex.runtime.causes import raise_causes
from mitex.runtime.devices import available_device
from mitex.runtime.health import Check, doctor
from mitex.runtime.memory import available_memory, keep_freed_memory
from mitex.runtime.precision import bfloat16_is_fast, mixed_precision, uses_bfloat16
from mitex.runtime.seeds import seed_everything
from mitex.runtime.session import init, load_mitsuba
from mitex.runtime.workers import (
    let_idle_threads_sleep,
    lower_worker_priority,
    set_workers,
    threads,
    use_one_blas_thread,
)

__all__ = [
    "Check",
    "available_device",
    "available_memory",
    "bfloat16_is_fast",
    "doctor",
    "init",
    "keep_freed_memory",
    "let_idle_threads_sleep",
    "load_mitsuba",
    "lower_worker_priority",
    "mixed_precision",
    "raise_causes",
    "seed_everything",
    "set_workers",
    "threads",
    "use_one_blas_thread",
    "uses_bfloat16",
]
