"""Which number formats this machine computes quickly."""

from __future__ import annotations

import os
from functools import cache
from pathlib import Path
from typing import TYPE_CHECKING

from mitex.errors import ConfigError

if TYPE_CHECKING:
    import torch

VARIABLE = "MITEX_BF16"
PRECISIONS = ("auto", "bfloat16", "float32")


def bfloat16_is_fast(device: str = "cpu") -> bool:
    """Whether frozen networks, and gradients of small ones, should be multiplied in bfloat16 on a device.

    They should where the CPU has AMX or AVX-512 instructions for it, or the graphics card tensor cores.
    `MITEX_BF16=0` or `1` decides instead.

    Raises:
        ConfigError: The variable has another value.
    """
    setting = os.environ.get(VARIABLE, "")
    if setting not in ("", "0", "1"):
        raise ConfigError(f"{VARIABLE} is '{setting}'", "set it to 0 or 1, or unset it")
    if setting:
        return setting == "1"
    if device == "cpu":
        return bool(bfloat16_flags())
    import torch

    return torch.cuda.is_bf16_supported(including_emulation=False)


def uses_bfloat16(precision: str, device: str = "cpu") -> bool:
    """Whether a network of a precision multiplies in bfloat16 on a device.

    Args:
        precision: "bfloat16", "float32", or "auto", as `bfloat16_is_fast` says.
        device: where it runs.

    Raises:
        ConfigError: Another precision.
    """
    if precision not in PRECISIONS:
        raise ConfigError(f"unknown precision {precision!r}", "use 'auto', 'bfloat16' or 'float32'")
    return precision == "bfloat16" or (precision == "auto" and bfloat16_is_fast(device))


def mixed_precision(device: str = "cpu") -> torch.autocast:
    """A context in which torch multiplies matrices in bfloat16, where that is fast on a device.

    Products and their gradients are bfloat16 then; weights, and gradients of weights, stay float32.
    Torch keeps what it compiles for each number of rows, some megabytes: round up numbers that vary.
    """
    import torch

    return torch.autocast(device, torch.bfloat16, enabled=bfloat16_is_fast(device))


@cache
def bfloat16_flags(cpuinfo: str = "/proc/cpuinfo") -> tuple[str, ...]:
    """The CPU's flags that make bfloat16 fast; empty where the system does not tell."""
    try:
        text = Path(cpuinfo).read_text()
    except OSError:
        return ()
    flags = next(
        (line.split(":", 1)[1].split() for line in text.splitlines() if line.startswith("flags")), []
    )
    return tuple(flag for flag in ("amx_bf16", "avx512_bf16") if flag in flags)
