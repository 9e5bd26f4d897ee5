"""Learning a texture: the image-guided training from exemplar to model file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Unpack

from mitex.errors import CheckpointError
from mitex.exemplar import Exemplar
from mitex.methods.nca import files
from mitex.methods.nca.config import PRESETS, NcaConfig
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.task import NcaTask
from mitex.methods.nca.texture import NcaTexture
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    exemplar: Exemplar | str | Path,
    out: str | Path,
    *,
    init: str | Path | None = None,
    **options: Unpack[RunOptions],
) -> NcaTexture:
    """Trains a MeshNCA on an exemplar; writes a run folder with the texture in it.

    Args:
        exemplar: maps, or what `Exemplar.load` takes.
        out: run folder; must be new or empty, or hold a run to resume.
        init: model to start from: the parent, if the two shall be graftable (section 4.4).
        options: preset ("patch" or "paper"), config, overrides, resume, quiet, as of `RunOptions`.

    Returns:
        The texture, also saved as `texture.safetensors` in `out`.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Interrupted: a checkpoint has been saved.
    """
    run = Run.of(PRESETS, out, **options)
    config = run.config
    maps = exemplar if isinstance(exemplar, Exemplar) else Exemplar.load(exemplar)
    origin: dict[str, Any] = {"exemplar": maps.name, "density": config.density}
    parent = None
    if init is not None:
        parent, about = _parent(init, config)
        origin["parent"] = str(about["name"])
    task = NcaTask(config, maps, parent)
    return run.train(
        task,
        maps.name,
        lambda about: NcaTexture(task.model, tuple(task.maps), about | origin),
        lr=config.lr,
        milestones=config.milestones,
        decay=config.decay,
        normalise_gradients=config.normalise_gradients,
    )


def _parent(init: str | Path, config: NcaConfig) -> tuple[MeshNCA, dict[str, Any]]:
    model, about = files.load(init)
    expected = (config.channels, config.hidden, config.degree, 0)
    shape = (model.channels, model.hidden, model.degree, model.condition)
    if shape != expected:
        raise CheckpointError(
            f"model '{about['name']}' has channels, hidden, degree, condition {shape}, the config {expected}",
            "set channels, hidden and degree alike",
        )
    return model, about
