"""Two methods that take no time to import: what they learn is a hash, one more for each step.

`stripes` learns from an exemplar and is put on any mesh, `inlay` learns on one mesh. An exemplar that begins
with `poison` is refused, one that begins with `crash` ends the process, one that begins with `helper` starts
another process, which takes 300 MB. In the environment, `STRIPES_LOG` is a file that gets a line for each
start, with some variables, and each step, and `STRIPES_PACE` the time of a step [s].
"""

from __future__ import annotations

import hashlib
import json
import os
import signal
import subprocess
import sys
import time
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar

from tyro.conf import arg

from mitex.errors import ImageError
from mitex.methods.method import Method
from mitex.methods.options import ExemplarOptions, MeshOptions
from mitex.paths import atomic_write
from mitex.runtime.signals import StopSignals
from mitex.runtime.workers import THREADS
from mitex.training.errors import Interrupted
from mitex.training.locate import CHECKPOINT, NAME
from mitex.training.settings import TrainingConfig, key


def described(name: str, fit: str) -> Method:
    return Method(
        name=name,
        title="a hash (for tests)",
        presets="stripes:PRESETS",
        fit=f"stripes:{fit}",
        apply="stripes:Apply",
        texture="stripes:Stripes",
    )


# Told at the start of a fit.
VARIABLES = (THREADS, "OMP_NUM_THREADS", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS", "DRJIT_CACHE_DIR")

STRIPES, INLAY = described("stripes", "Fit"), described("inlay", "FitOnMesh")


@dataclass(frozen=True)
class Config(TrainingConfig):
    preset: str = "plain"
    depth: float = key(0.5, "of a stripe", 0, 10)
    width: float = key(1.0, "of a stripe", 0.1, 10)


PRESETS = {"plain": Config()}


class Stripes:
    """Only its file matters."""


def tell(*words: object) -> None:
    with open(os.environ["STRIPES_LOG"], "a") as file:
        print(*words, file=file, flush=True)


@dataclass(kw_only=True)
class Fit(ExemplarOptions):
    """Learn a hash.

    examples:
      mitex fit stripes --exemplar lava
    """

    only_at_start: ClassVar[frozenset[str]] = frozenset({"salt"})

    salt: Annotated[str, arg(metavar="TEXT")] = ""
    """Goes into the first hash."""

    name: ClassVar[str] = "stripes"

    def read(self) -> bytes:
        content = Path(self.exemplar).read_bytes()
        if content.startswith(b"poison"):
            raise ImageError(f"'{self.exemplar}' is poisoned", "take another one")
        if content.startswith(b"crash"):
            os.kill(os.getpid(), signal.SIGKILL)
        if content.startswith(b"helper"):
            subprocess.run([sys.executable, "-c", "bytearray(300 << 20)"], check=True)
        return content

    def run(self) -> None:
        assert self.out is not None and not (self.resume and self.salt)
        tell("start", self.out.name, *(os.environ.get(name) for name in VARIABLES))
        step, value = 0, hashlib.sha256(self.read() + self.salt.encode()).hexdigest()
        place = self.out / CHECKPOINT
        if self.resume:
            step, value = json.loads(place.read_text())
        with StopSignals() as signals:
            while step < (self.steps or 1):
                time.sleep(float(os.environ.get("STRIPES_PACE", "0")))
                step, value = step + 1, hashlib.sha256(value.encode()).hexdigest()
                with atomic_write(place) as temporary:
                    temporary.write_text(json.dumps([step, value]))
                tell("step", self.out.name, step)
                if signals.requested:
                    raise Interrupted(place, step)
        self.save(value)

    def save(self, value: str) -> None:
        import numpy as np
        from safetensors.numpy import save_file

        assert self.out is not None
        texture = np.frombuffer(bytes.fromhex(value), np.uint8)
        save_file({"value": texture}, self.out / NAME, {"format": f"mitex-{self.name}-1"})
        (self.out / "metrics.jsonl").write_text('{"step": 1, "loss": 2.0}\n{"step": 2, "loss": 0.5}\n')


@dataclass(kw_only=True)
class FitOnMesh(Fit):
    """Learn a hash of an exemplar and a mesh.

    examples:
      mitex fit inlay --exemplar lava --mesh vase
    """

    name: ClassVar[str] = "inlay"

    fits_to_mesh: ClassVar[bool] = True

    mesh: Annotated[str, arg(metavar="MESH")]
    """A file."""

    def read(self) -> bytes:
        return super().read() + Path(self.mesh).read_bytes()


@dataclass(kw_only=True)
class Apply(MeshOptions):
    """Write the hash of the texture and a mesh.

    examples:
      mitex apply runs/stripes --mesh vase --out a.glb
    """

    turn: Annotated[float, arg(metavar="DEG")] = 0.0
    """Goes into the hash."""

    def run(self) -> None:
        tell("start", Path(self.out).parent.name, os.environ.get(THREADS))
        content = (Path(self.model) / NAME).read_bytes() + Path(self.mesh).read_bytes()
        with atomic_write(self.out) as temporary:
            temporary.write_bytes(hashlib.sha256(content + str(self.turn).encode()).digest())
