"""`python -m tests.fuzz.run LOADER FIRST COUNT`: reads damaged files in a process with limits, and reports.

Each case is reproduced by its number alone: `python -m tests.fuzz.run LOADER NUMBER 1`.
"""

from __future__ import annotations

import json
import resource
import signal
import sys
import tempfile
import traceback
import warnings
import zlib
from pathlib import Path

import numpy as np

from mitex.errors import MitexError
from tests.fuzz.loaders import LOADERS, Loader
from tests.fuzz.mutations import mutated

SECONDS = 20  # of a case
MEMORY = 6 << 30  # of the process [bytes]


def run(name: str, first: int, count: int) -> dict:
    """Reads `count` damaged files; returns how many were read and refused, and what went wrong."""
    loader, report = LOADERS[name], {"read": 0, "refused": 0, "faults": []}
    with tempfile.TemporaryDirectory() as folder, warnings.catch_warnings():
        warnings.simplefilter("ignore")
        path = Path(folder) / loader.file
        path.parent.mkdir(parents=True, exist_ok=True)
        loader.write(path)
        valid = path.read_bytes()
        loader.read(path)
        for number in range(first, first + count):
            path.parent.mkdir(exist_ok=True)
            path.unlink(missing_ok=True)  # to truncate it would wait for the disk
            path.write_bytes(mutated(valid, np.random.default_rng([zlib.crc32(name.encode()), number])))
            outcome = _case(loader, path)
            if outcome in report:
                report[outcome] += 1
            else:
                report["faults"].append([number, outcome])
    return report


def _case(loader: Loader, path: Path) -> str:
    """ "read", "refused", or what went wrong."""
    signal.alarm(SECONDS)
    try:
        loader.read(path)
    except MitexError as error:
        return "refused" if "\n" not in str(error) else f"an error of several lines: {error}"
    except BaseException:
        return traceback.format_exc()[-1500:]
    finally:
        signal.alarm(0)
    return "read"


class TooLong(BaseException):
    """Of a case; no loader takes it for something that its file has caused."""


def _too_long(number: int, frame: object) -> None:
    raise TooLong(f"more than {SECONDS} s")


if __name__ == "__main__":
    resource.setrlimit(resource.RLIMIT_DATA, (MEMORY, MEMORY))
    signal.signal(signal.SIGALRM, _too_long)
    names = list(LOADERS) if sys.argv[1] == "all" else [sys.argv[1]]
    for name in names:
        print(json.dumps({"loader": name, **run(name, int(sys.argv[2]), int(sys.argv[3]))}), flush=True)
