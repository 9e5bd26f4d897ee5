"""What Mitex runs on: LLVM, Mitsuba and its variant, threads, seeds, number formats, and their report."""

from mitex.runtime.health import Check, doctor
from mitex.runtime.memory import available_memory, keep_freed_memory
from mitex.runtime.precision import bfloat16_is_fast
from mitex.runtime.session import (
    init,
    load_mitsuba,
    modest_workers,
    seed_everything,
    set_workers,
    threads,
    yield_cores,
)

__all__ = [
    "Check",
    "available_memory",
    "bfloat16_is_fast",
    "doctor",
    "init",
    "keep_freed_memory",
    "load_mitsuba",
    "modest_workers",
    "seed_everything",
    "set_workers",
    "threads",
    "yield_cores",
]
