"""How a training can end early."""

from pathlib import Path

from mitex.errors import MitexError


class TrainingDiverged(MitexError):
    """Loss or gradients stopped being finite; the last good checkpoint is kept."""


class Cancelled(MitexError):
    """The caller's `cancel` stopped a fit after a whole step.

    Attributes:
        checkpoint: The checkpoint that was saved; None of a fit in memory, or before the training.
        step: Steps done.
    """

    def __init__(self, checkpoint: Path | None, step: int):
        super().__init__(f"cancelled after step {step}", _way_on(checkpoint))
        self.checkpoint = checkpoint
        self.step = step

    def __reduce__(self):
        return Cancelled, (self.checkpoint, self.step)


class Interrupted(KeyboardInterrupt):
    """A signal (Ctrl-C, SIGTERM) stopped the run after a whole step; the command line exits with code 130.

    Attributes:
        checkpoint: The checkpoint that was saved; None of a fit in memory.
        step: Steps done.
    """

    def __init__(self, checkpoint: Path | None, step: int):
        super().__init__(f"interrupted after step {step}; {_way_on(checkpoint)}")
        self.checkpoint = checkpoint
        self.step = step


def _way_on(checkpoint: Path | None) -> str:
    if checkpoint is None:
        return "nothing has been kept, so start again"
    return f"continue with `resume=True` (checkpoint in '{checkpoint}')"
