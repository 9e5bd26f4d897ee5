"""How much memory is free, and what the C library does with what is freed."""

import ctypes
import os
from contextlib import suppress
from functools import cache
from pathlib import Path

_MMAP_THRESHOLD, _TRIM_THRESHOLD = -3, -1  # names of mallopt(3)
_NEVER = 2**31 - 1  # the largest value it takes


@cache
def keep_freed_memory() -> bool:
    """Tells glibc to keep freed memory for the next allocation instead of giving it back to the kernel.

    A training step frees and allocates the same hundreds of megabytes over and over; by default each time
    comes from the kernel anew, page by page, zeroed, which takes longer than the computation on it. The
    process then keeps its peak memory until it ends. Called by what needs it, once a process.

    Returns:
        Whether it is in effect: False without glibc, and where the user has tuned its allocator through
        `MALLOC_*` or `GLIBC_TUNABLES`.
    """
    tuned = any(name.startswith("MALLOC_") for name in os.environ)
    if tuned or "glibc.malloc" in os.environ.get("GLIBC_TUNABLES", "") or not _is_glibc():
        return False
    mallopt = ctypes.CDLL(None).mallopt
    # glibc before 2.35 refuses thresholds above 32 MB.
    large = mallopt(_MMAP_THRESHOLD, 1 << 30) or mallopt(_MMAP_THRESHOLD, 32 << 20)
    return bool(large and mallopt(_TRIM_THRESHOLD, _NEVER))


def available_memory() -> int | None:
    """Memory that can be taken without swapping [bytes], by the system's estimate; None if it has none."""
    with suppress(OSError, ValueError):
        for line in Path("/proc/meminfo").read_text(encoding="ascii").splitlines():
            name, _, rest = line.partition(":")
            if name == "MemAvailable":
                return int(rest.split()[0]) * 1024
    return None


def _is_glibc() -> bool:
    try:
        return (os.confstr("CS_GNU_LIBC_VERSION") or "").startswith("glibc")
    except (AttributeError, ValueError, OSError):
        return False
