"""Python's garbage collector waits while Dr.Jit records a kernel.

A render that fails, and any cycle of references, can leave a scene to the collector. If it frees the scene
while another kernel is recorded, Mitsuba ends the process with a segmentation fault. So collections that
begin there find nothing to do, and a later one frees the scene.
"""

from __future__ import annotations

import gc
import sys
from typing import Any


def collect_between_kernels() -> None:
    """Makes all later collections of this process wait for the end of a recording; cheap to call again.

    Objects that `gc.freeze` has set apart become ordinary ones again at the end of a collection that waited.
    """
    if _hide_objects not in gc.callbacks:
        gc.callbacks.append(_hide_objects)


_hidden = False  # whether the collection that runs was given nothing to do


def _hide_objects(phase: str, _info: dict[str, Any]) -> None:
    """A callback of the collector: nothing can stop a collection, but frozen objects are none of its."""
    global _hidden
    if phase == "start" and _is_recording():
        gc.freeze()
        _hidden = True
    elif phase == "stop" and _hidden:
        gc.unfreeze()
        _hidden = False


def _is_recording() -> bool:
    dr = sys.modules.get("drjit")
    return dr is not None and bool(dr.flag(dr.JitFlag.SymbolicScope))
