"""Optimizing a flat picture: from an exemplar to a model file."""

from __future__ import annotations

from pathlib import Path
from typing import Unpack

from mitex.exemplar import Exemplar
from mitex.methods.baselines.gatys.config import PRESETS
from mitex.methods.baselines.gatys.task import GatysTask
from mitex.methods.baselines.gatys.texture import GatysTexture
from mitex.training.fit import Run
from mitex.training.lbfgs import Lbfgs
from mitex.training.optim import Adam
from mitex.training.settings import RunOptions


def fit(
    exemplar: Exemplar | str | Path, out: str | Path | None = None, **options: Unpack[RunOptions]
) -> GatysTexture:
    """Optimizes a flat picture with the look of an exemplar; writes a run folder with the picture in it.

    Args:
        exemplar: maps, of which the albedo is matched, or what `Exemplar.load` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        options: preset ("default" or "paper"), and those of `RunOptions`.

    Returns:
        The picture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    run = Run.of(PRESETS, out, **options)
    target = Exemplar.of(exemplar).of_albedo()
    task = GatysTask(run.config, target)
    return run.train(
        task,
        target.name,
        lambda about: GatysTexture(task.image.detach().numpy(), run.config.resolution, about),
        lr=run.config.lr,
        optimizer=Lbfgs if run.config.optimizer == "lbfgs" else Adam,
    )
