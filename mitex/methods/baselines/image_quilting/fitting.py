"""Quilting a picture: from an exemplar to a model file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Unpack

import numpy as np

from mitex.exemplar import Exemplar
from mitex.methods.baselines.image_quilting import METHOD
from mitex.methods.baselines.image_quilting.config import OVERLAP, PRESETS
from mitex.methods.baselines.image_quilting.quilting import quilt
from mitex.methods.baselines.image_quilting.texture import QuiltedPicture
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    exemplar: Exemplar | str | Path, out: str | Path | None = None, **options: Unpack[RunOptions]
) -> QuiltedPicture:
    """Quilts a picture of blocks of an exemplar; writes a run folder with the picture in it.

    Args:
        exemplar: maps, of which the albedo is used, or what `Exemplar.load` takes.
        out: run folder; must be new or empty; None writes no file.
        options: preset ("default" or "paper"), and those of `RunOptions` but `steps` and `resume`; `on_step`
            is not called.

    Returns:
        The picture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
    """
    run = Run.of(PRESETS, out, **options)
    source = Exemplar.of(exemplar).of_albedo()
    config = run.config

    def quilted(about: dict[str, Any]) -> QuiltedPicture:
        image = quilt(
            source.resized(config.exemplar_size).maps["albedo"],
            config.size,
            config.block,
            config.block // OVERLAP,
            np.random.default_rng(config.seed),
            tolerance=config.tolerance,
            soft=config.soft,
        )
        return QuiltedPicture(image.clip(0, 1), config.resolution, about)

    return run.compute(METHOD.name, source.name, quilted, exemplar=source.name)
