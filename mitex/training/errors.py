"""How a training can end early."""

from pathlib import Path

from mitex.errors import MitexError


class TrainingDiverged(MitexError):
    """Loss or gradients stopped being finite; the last good checkpoint is kept."""


class Interrupted(KeyboardInterrupt):
    """A signal (Ctrl-C, SIGTERM) stopped the run after a whole step; the command line exits with code 130.

    Attributes:
        checkpoint: The checkpoint that was saved.
        step: Steps done.
    """

    def __init__(self, checkpoint: Path, step: int):
        super().__init__(
            f"interrupted after step {step}; continue with --resume (checkpoint in '{checkpoint}')"
        )
        self.checkpoint = checkpoint
        self.step = step
