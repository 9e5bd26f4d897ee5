"""Learning a texture from words: from a prompt to a model file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Any, Unpack

from mitex.features.text_model import text_image_model
from mitex.mesh import Mesh
from mitex.methods.nca import files
from mitex.methods.nca.config import PRESETS, NcaConfig
from mitex.methods.nca.look import Look, weights_key
from mitex.methods.nca.motion.start import motion_record, training_look
from mitex.methods.nca.parents import fitting_lineage, resumed_lineage
from mitex.methods.nca.text.moving import MovingTextTask
from mitex.methods.nca.text.task import TextTask
from mitex.methods.nca.text.wording import MAPS, check, with_maps
from mitex.methods.nca.texture import NcaTexture
from mitex.methods.words.wording import words_options
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit_text(
    text: str,
    out: str | Path | None = None,
    *,
    mesh: Mesh | None = None,
    clip: str | os.PathLike[str] | None = None,
    init: str | Path | None = None,
    motion: str | None = None,
    **options: Unpack[RunOptions],
) -> NcaTexture:
    """Trains a MeshNCA to be what words say; writes a run folder with the texture in it.

    The texture has colours and a relief, and can be put on any mesh. A frozen vision-language model
    compares: see `mitex.features.text_model.text_image_model`.

    Args:
        text: what the texture is made of, such as "red bricks".
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        mesh: to train on instead of spheres, for textures that shall know its shape; the prompt calls it by
            its name, unless `text_object` is set.
        clip: CLIP folder, or "words" for the model that ships with Mitex; None for the first that there is.
        init: model to start from; the setting `text_parent` if None.
        motion: the vector field that the texture learns to move along, as of `mitex.methods.nca.fit`.
        options: preset ("text", "text-words" or "text-paper"), and those of `RunOptions`; by default
            "text-words" for the model that ships with Mitex, else "text".

    Returns:
        The texture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    inputs = {"text": text, "text_model": clip and os.fspath(clip), "motion": motion}
    run = Run.of(PRESETS, out, **words_options(options, inputs))
    config = run.config
    check(config)
    look, lineage = _start(init, run)
    model = text_image_model(config.text_model, config.device)
    task = (MovingTextTask if config.motion else TextTask)(config, model, look, lineage, mesh)
    run.check_inputs(task.metadata())

    def texture(about: dict[str, Any]) -> NcaTexture:
        look = task.look.to("cpu")
        known = {"text": config.text, "text_model": model.name, "relief": config.text_relief}
        known |= motion_record(config) | {"growth_steps": config.text_growth_steps}
        family = {"family": weights_key(look)}
        return NcaTexture(look, about | {"density": config.density} | known | family | lineage)

    return run.train(task, str(config.text), texture, **config.schedule)


def _start(init: str | Path | None, run: Run[NcaConfig]) -> tuple[Look | None, dict[str, str]]:
    """The look that a training starts from, with its lineage; None for new weights, or for those of a run."""
    source = init or run.config.text_parent
    if source is None or run.resume:
        return None, resumed_lineage(run)
    parent, about = files.load(source)
    parent = training_look(run.config, with_maps(parent, MAPS))
    return parent, fitting_lineage(parent, about, Look.of(run.config, MAPS))
