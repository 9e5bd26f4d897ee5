"""Fits of neural style fields from words: from a text and a mesh to a texture file."""

from __future__ import annotations

import os
from collections.abc import Mapping
from pathlib import Path
from typing import TypeVar, Unpack

from mitex.features.text_model import text_image_model
from mitex.mesh import Mesh
from mitex.methods.layout import with_layout
from mitex.methods.neural_style.config import StyleConfig
from mitex.methods.neural_style.styled_mesh import StyledMesh
from mitex.methods.neural_style.task import StyleTask
from mitex.methods.words.wording import check_text, words_options
from mitex.training.fit import Run
from mitex.training.settings import RunOptions

Texture = TypeVar("Texture", bound=StyledMesh)


def fit_style(
    presets: Mapping[str, StyleConfig],
    kind: tuple[type[StyleTask], type[Texture]],
    text: str,
    mesh: Mesh | str | Path,
    out: str | Path | None,
    clip: str | os.PathLike[str] | None,
    keep_uvs: bool,
    **options: Unpack[RunOptions],
) -> Texture:
    """Learns colours and a shape of a mesh from words; writes a run folder with the texture in it.

    Args:
        presets: of the method.
        kind: its task and its texture.
        text: what the mesh is made of.
        mesh: or what `Mesh.load` takes.
        out: run folder; None writes no file.
        clip: CLIP folder, or "words"; None for the first model that there is.
        keep_uvs: use the mesh's own UVs.
        options: those of `RunOptions`.

    Raises:
        MitexError: as the method's own `fit`, which says more.
    """
    inputs = {"text": text, "text_model": clip and os.fspath(clip)}
    run = Run.of(presets, out, **words_options(options, inputs))
    config = run.config
    check_text(config.text, config.preset)
    model = text_image_model(config.text_model)
    given = Mesh.of(mesh)
    model.encode_texts([config.prompt(given.name)])  # refuses unknown words before the mesh is unwrapped
    surface = with_layout(given, config.resolution, keep_uvs)
    run.control.check()
    task = kind[0](config, model, surface)
    return run.train(
        task,
        str(config.text),
        lambda about: kind[1](
            surface, task.baked(), about | {"text": config.text, "text_model": model.name}, task.shape()
        ),
        **config.schedule,
    )
