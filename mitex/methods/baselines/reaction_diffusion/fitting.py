"""Learning a reaction: from an exemplar to a model file."""

from __future__ import annotations

from pathlib import Path
from typing import Unpack

from mitex.exemplar import Exemplar
from mitex.methods.baselines.reaction_diffusion.config import PRESETS
from mitex.methods.baselines.reaction_diffusion.task import ReactionDiffusionTask
from mitex.methods.baselines.reaction_diffusion.texture import ReactionDiffusionTexture
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    exemplar: Exemplar | str | Path, out: str | Path | None = None, **options: Unpack[RunOptions]
) -> ReactionDiffusionTexture:
    """Learns chemicals whose pattern looks like an exemplar; writes a run folder with the model in it.

    Args:
        exemplar: maps, of which the albedo is learned, or what `Exemplar.load` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        options: preset ("default" or "paper"), and those of `RunOptions`.

    Returns:
        The texture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    run = Run.of(PRESETS, out, **options)
    config = run.config
    target = Exemplar.of(exemplar).of_albedo()
    task = ReactionDiffusionTask(config, target)
    return run.train(
        task,
        target.name,
        lambda about: ReactionDiffusionTexture(task.reaction, config.exemplar_size, config.width, about),
        **config.schedule,
        normalise_gradients=True,
    )
