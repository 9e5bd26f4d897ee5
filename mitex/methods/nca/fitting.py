"""Learning a texture: the image-guided training from exemplar to model file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Unpack

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.methods.nca import files
from mitex.methods.nca.look import Look, weights_key
from mitex.methods.nca.motion.start import (
    check_albedo,
    check_field,
    motion_options,
    motion_record,
    presets_from,
    training_look,
)
from mitex.methods.nca.motion.task import MotionTask
from mitex.methods.nca.palette import Palette
from mitex.methods.nca.parents import fitting_lineage, resumed_lineage
from mitex.methods.nca.settling import settling_steps
from mitex.methods.nca.task import NcaTask
from mitex.methods.nca.texture import NcaTexture
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    exemplar: Exemplar | str | Path,
    out: str | Path | None = None,
    *,
    init: str | Path | None = None,
    motion: str | None = None,
    **options: Unpack[RunOptions],
) -> NcaTexture:
    """Trains a MeshNCA on an exemplar; writes a run folder with the texture in it.

    Args:
        exemplar: maps, or what `Exemplar.load` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        init: model to start from: the parent, if the two shall be graftable (section 4.4), or the still look
            of a moving one, which then has the still one's `density` unless the settings name another.
        motion: the vector field that the texture learns to move along, by name or direction (see
            `mitex.mesh.fields`); the preset is then "motion" unless another is named.
        options: preset ("patch", "paper", "motion" or "motion-paper"), and those of `RunOptions`.

    Returns:
        The texture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    parent, about = (None, {}) if init is None else files.load(init)
    settings = options if motion is None else motion_options(options, motion)
    run = Run.of(presets_from(about, motion), out, **settings)
    config = run.config
    if config.text is not None:
        raise ConfigError(
            "the settings are for words, not for an exemplar", "give a `text`, or another preset"
        )
    if config.motion:
        check_field(config.motion)
    maps = Exemplar.of(exemplar)
    check_albedo(config, maps.maps)
    origin: dict[str, Any] = {"exemplar": maps.name, "density": config.density}
    if "albedo" in maps.maps:
        origin["palette"] = Palette.of(maps.maps["albedo"]).record()
    lineage = resumed_lineage(run)
    if parent is not None:
        parent = training_look(config, parent)
        lineage = fitting_lineage(parent, about, Look.of(config, sorted(maps.maps)))
    origin |= motion_record(config)
    task = (MotionTask if config.motion else NcaTask)(config, maps, parent, lineage)

    def texture(about: dict[str, Any]) -> NcaTexture:
        look = task.look.to("cpu")
        steps = settling_steps(look, task.exemplar, config.density, origin)
        family = {"family": weights_key(look)}
        return NcaTexture(look, about | origin | family | lineage | {"growth_steps": steps})

    return run.train(task, maps.name, texture, **config.schedule)
