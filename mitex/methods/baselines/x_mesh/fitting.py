"""Learning with X-Mesh: from words and a mesh to a texture file."""

from __future__ import annotations

import os
from pathlib import Path
from typing import Unpack

from mitex.mesh import Mesh
from mitex.methods.baselines.x_mesh.config import PRESETS
from mitex.methods.baselines.x_mesh.task import XMeshTask
from mitex.methods.baselines.x_mesh.texture import XMeshTexture
from mitex.methods.neural_style.fitting import fit_style
from mitex.training.settings import RunOptions


def fit(
    text: str,
    mesh: Mesh | str | Path,
    out: str | Path | None = None,
    *,
    clip: str | os.PathLike[str] | None = None,
    keep_uvs: bool = False,
    **options: Unpack[RunOptions],
) -> XMeshTexture:
    """Learns colours and offsets of a mesh from words; writes a run folder with the texture in it.

    Args:
        text: what the mesh is made of, such as "red bricks".
        mesh: or what `Mesh.load` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        clip: CLIP folder, or "words" for the model that ships with Mitex; None for the first that there is.
        keep_uvs: use the mesh's own UVs.
        options: preset ("text-words", "text" or "text-paper"), and those of `RunOptions`; by default
            "text-words" for the model that ships with Mitex, else "text".

    Returns:
        The texture with the moved mesh, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    return fit_style(PRESETS, (XMeshTask, XMeshTexture), text, mesh, out, clip, keep_uvs, **options)
