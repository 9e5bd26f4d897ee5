"""Learning a texture: the image-guided training from exemplar to model file."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from mitex.errors import CheckpointError
from mitex.exemplar import Exemplar
from mitex.methods.nca import files
from mitex.methods.nca.config import PRESETS, NcaConfig
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.task import NcaTask
from mitex.methods.nca.texture import NcaTexture
from mitex.training import run, train


def fit(
    exemplar: Exemplar | str | Path,
    out: str | Path,
    *,
    preset: str | None = None,
    config: Path | None = None,
    overrides: Sequence[str] = (),
    resume: bool = False,
    init: str | Path | None = None,
    quiet: bool = False,
) -> NcaTexture:
    """Trains a MeshNCA on an exemplar; writes a run folder with the model in it.

    Args:
        exemplar: maps, or what `Exemplar.load` takes.
        out: run folder; must be new or empty, or hold a run to `resume`.
        preset: "patch" (default) or "paper".
        config: TOML file with any of `NcaConfig`'s keys.
        overrides: `key=value`, for any key.
        resume: go on from the run's checkpoint, with its config as far as no other is given.
        init: model to start from: the parent, if the two shall be graftable (section 4.4).
        quiet: show no progress.

    Returns:
        The texture, also saved as `model.safetensors` in `out`.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Interrupted: a checkpoint has been saved.
    """
    out = Path(out).expanduser()
    settings = run.settings(PRESETS, out, preset, config, overrides, resume)
    shown = exemplar if isinstance(exemplar, Exemplar) else Exemplar.load(exemplar)
    task = NcaTask(settings, shown, None if init is None else _parent(init, settings))
    result = train(
        task,
        settings,
        out,
        lr=settings.lr,
        milestones=settings.milestones,
        decay=settings.decay,
        normalise_gradients=settings.normalise_gradients,
        resume=resume,
        quiet=quiet,
    )
    about = result.about(shown.name, settings.preset)
    about |= {"exemplar": shown.name, "density": settings.density}
    if init is not None:
        about["parent"] = str(files.load(init)[1]["name"])
    texture = NcaTexture(task.model, tuple(task.maps), about)
    texture.save(out / files.NAME)
    return texture


def _parent(init: str | Path, config: NcaConfig) -> MeshNCA:
    model, about = files.load(init)
    wanted = (config.channels, config.hidden, config.degree, 0)
    found = (model.channels, model.hidden, model.degree, model.condition)
    if wanted != found:
        raise CheckpointError(
            f"model '{about['name']}' has channels, hidden, degree, condition {found}, the config {wanted}",
            "set channels, hidden and degree alike",
        )
    return model
