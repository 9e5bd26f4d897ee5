"""Learning with Text2Mesh: from exemplar or words, and a mesh, to a texture file."""

from __future__ import annotations

import os
from dataclasses import fields
from pathlib import Path
from typing import Unpack

from mitex.errors import ConfigError
from mitex.exemplar import Exemplar
from mitex.mesh import Mesh
from mitex.methods.baselines.text2mesh.config import DEFAULT, PRESETS
from mitex.methods.baselines.text2mesh.task import Text2MeshTask
from mitex.methods.baselines.text2mesh.text_task import Text2MeshTextTask
from mitex.methods.baselines.text2mesh.texture import Text2MeshTexture
from mitex.methods.checks import reject_idle
from mitex.methods.layout import with_layout
from mitex.methods.neural_style.fitting import fit_style
from mitex.training.fit import Run
from mitex.training.settings import RunOptions

OF_WORDS = {field.name for field in fields(DEFAULT) if field.name.startswith("text_")}
OF_EXEMPLARS = {"exemplar_size", "layers", "samples", "moment_weight"}


def fit(
    exemplar: Exemplar | str | Path,
    mesh: Mesh | str | Path,
    out: str | Path | None = None,
    *,
    keep_uvs: bool = False,
    **options: Unpack[RunOptions],
) -> Text2MeshTexture:
    """Learns colours of a mesh whose views look like an exemplar; writes a run folder with the texture in it.

    Args:
        exemplar: maps, of which the albedo is matched, or what `Exemplar.load` takes.
        mesh: or what `Mesh.load` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        keep_uvs: use the mesh's own UVs.
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
    if config.text is not None:
        raise ConfigError(
            f"the preset {config.preset} is for words, not for exemplars", "use default or paper"
        )
    reject_idle(options.get("set", ()), OF_WORDS, "without words")
    target = Exemplar.of(exemplar).of_albedo()
    given = Mesh.of(mesh)
    surface = with_layout(given, config.resolution, keep_uvs)
    run.control.check()
    task = Text2MeshTask(config, target, surface)
    return run.train(
        task,
        target.name,
        lambda about: Text2MeshTexture(surface, task.baked(), about),
        **config.schedule,
    )


def fit_text(
    text: str,
    mesh: Mesh | str | Path,
    out: str | Path | None = None,
    *,
    clip: str | os.PathLike[str] | None = None,
    keep_uvs: bool = False,
    **options: Unpack[RunOptions],
) -> Text2MeshTexture:
    """Learns colours and offsets along the normals of a mesh from words; writes a run folder as `fit`.

    Args:
        text: what the mesh is made of, such as "red bricks".
        mesh, out, keep_uvs: as of `fit`.
        clip: CLIP folder, or "words" for the model that ships with Mitex; None for the first that there is.
        options: preset ("text", "text-words" or "text-paper"), and those of `RunOptions`; by default
            "text-words" for the model that ships with Mitex, else "text".

    Returns:
        The texture with the moved mesh, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError, Cancelled, Interrupted: as `fit`.
    """
    reject_idle(options.get("set", ()), OF_EXEMPLARS, "without an exemplar")
    kind = Text2MeshTextTask, Text2MeshTexture
    return fit_style(PRESETS, kind, text, mesh, out, clip, keep_uvs, **options)
