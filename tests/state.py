"""What a program has that Mitex must leave as it was."""

import os
import random
import signal
import threading
import warnings
from collections.abc import Callable
from concurrent.futures import ThreadPoolExecutor
from typing import Any

import numpy as np
import scipy.sparse  # noqa: F401  (scipy adds filters of warnings when it is loaded)
import scipy.spatial  # noqa: F401
import scipy.special  # noqa: F401
import torch

import mitex


def in_thread(call: Callable[[], Any]) -> Any:
    """The result of a call in a new thread; what it raises is raised here."""
    with ThreadPoolExecutor(1) as pool:
        return pool.submit(call).result()


def program_state() -> dict[str, Any]:
    """By name, for comparison. Starts Mitsuba if need be."""
    mi = mitex.init()
    return {
        "torch's generator": torch.get_rng_state().numpy().tobytes(),
        "NumPy's generator": repr(np.random.get_state()),
        "Python's generator": random.getstate(),
        "torch's threads": torch.get_num_threads(),
        "torch's threads in a new thread": in_thread(torch.get_num_threads),
        "torch's type": torch.get_default_dtype(),
        "gradients": torch.is_grad_enabled(),
        "NumPy's errors": np.geterr(),
        "warnings": (list(warnings.filters), warnings.showwarning),
        "signals": [signal.getsignal(number) for number in (signal.SIGINT, signal.SIGTERM)],
        "variant": mi.variant(),
        "log level": mi.logger().log_level(),
        "environment": dict(os.environ),
        "folder": os.getcwd(),
        "main thread": threading.main_thread(),
    }
