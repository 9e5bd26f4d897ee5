"""Training: one loop, its config, checkpoints, metrics and progress.

Names are resolved on first use: configs and errors are needed where torch is not loaded.
"""

from typing import TYPE_CHECKING

from mitex.lazy import attributes

__all__ = [
    "Cancelled",
    "Change",
    "Interrupted",
    "ParameterTask",
    "Progress",
    "Step",
    "Task",
    "TrainResult",
    "TrainingDiverged",
    "resolve",
    "train",
]

__getattr__ = attributes(
    __name__,
    {
        "Cancelled": "mitex.training.errors",
        "Change": "mitex.training.task",
        "Interrupted": "mitex.training.errors",
        "ParameterTask": "mitex.training.task",
        "Progress": "mitex.training.control",
        "Step": "mitex.training.task",
        "Task": "mitex.training.task",
        "TrainResult": "mitex.training.loop",
        "TrainingDiverged": "mitex.training.errors",
        "resolve": "mitex.training.config",
        "train": "mitex.training.loop",
    },
)

if TYPE_CHECKING:
    from mitex.training.config import resolve
    from mitex.training.control import Progress
    from mitex.training.errors import Cancelled, Interrupted, TrainingDiverged
    from mitex.training.loop import TrainResult, train
    from mitex.training.task import Change, ParameterTask, Step, Task
