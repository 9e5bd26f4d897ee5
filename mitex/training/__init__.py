"""Training: one loop, its config, checkpoints, metrics and progress.

Names are resolved on first use: configs and errors are wanted where torch is not.
"""

from importlib import import_module
from typing import TYPE_CHECKING, Any

__all__ = [
    "Change",
    "Interrupted",
    "ParameterTask",
    "Step",
    "Task",
    "TrainResult",
    "TrainingDiverged",
    "resolve",
    "train",
]

_HOMES = {
    "Change": "task",
    "Interrupted": "errors",
    "ParameterTask": "task",
    "Step": "task",
    "Task": "task",
    "TrainResult": "loop",
    "TrainingDiverged": "errors",
    "resolve": "config",
    "train": "loop",
}

if TYPE_CHECKING:
    from mitex.training.config import resolve
    from mitex.training.errors import Interrupted, TrainingDiverged
    from mitex.training.loop import TrainResult, train
    from mitex.training.task import Change, ParameterTask, Step, Task


def __getattr__(name: str) -> Any:
    if name not in _HOMES:
        raise AttributeError(f"module 'mitex.training' has no attribute {name!r}")
    value = getattr(import_module(f"mitex.training.{_HOMES[name]}"), name)
    globals()[name] = value
    return value
