"""Optimizing a texture through views of a mesh: from exemplar and mesh to texture file."""

from __future__ import annotations

from pathlib import Path
from typing import Unpack

import numpy as np

from mitex.exemplar import Exemplar
from mitex.images import read_image, resize
from mitex.mesh import Mesh
from mitex.methods.baselines.multi_view_gram.config import PRESETS
from mitex.methods.baselines.multi_view_gram.task import MultiViewTask
from mitex.methods.baselines.multi_view_gram.texture import MultiViewTexture
from mitex.methods.layout import with_content_layout, with_layout
from mitex.paths import expanded
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    exemplar: Exemplar | str | Path,
    mesh: Mesh | str | Path,
    out: str | Path | None = None,
    *,
    keep_uvs: bool = False,
    content: str | Path | None = None,
    **options: Unpack[RunOptions],
) -> MultiViewTexture:
    """Optimizes a texture whose views look like an exemplar; writes a run folder with the texture in it.

    Args:
        exemplar: maps, of which the albedo is matched, or what `Exemplar.load` takes.
        mesh: or what `Mesh.load` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        keep_uvs: use the mesh's own UVs.
        content: style transfer: a texture on the mesh's own UVs (an image file), which are kept then.
        options: preset ("default" or "paper"), and those of `RunOptions`.

    Returns:
        The texture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    run = Run.of(PRESETS, out, **options)
    target = Exemplar.of(exemplar).of_albedo()
    side = run.config.resolution
    given = Mesh.of(mesh)
    original: np.ndarray | None = None
    if content is None:
        surface = with_layout(given, side, keep_uvs)
    else:
        original = resize(read_image(expanded(content)), side, side)
        surface = with_content_layout(given)
    run.control.check()
    task = MultiViewTask(run.config, target, surface, original)
    return run.train(
        task,
        target.name,
        lambda about: MultiViewTexture(surface, task.texture.detach().numpy(), about),
        lr=run.config.lr,
    )
