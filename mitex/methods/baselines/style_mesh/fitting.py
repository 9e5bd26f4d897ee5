"""Optimizing a texture with StyleMesh: from exemplar and mesh to texture file."""

from __future__ import annotations

from pathlib import Path
from typing import Unpack

from mitex.exemplar import Exemplar
from mitex.mesh import Mesh
from mitex.methods.baselines.style_mesh.config import PRESETS
from mitex.methods.baselines.style_mesh.task import StyleMeshTask
from mitex.methods.baselines.style_mesh.texture import StyleMeshTexture
from mitex.methods.checks import reject_idle
from mitex.methods.layout import with_layout
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    exemplar: Exemplar | str | Path,
    mesh: Mesh | str | Path,
    out: str | Path | None = None,
    *,
    keep_uvs: bool = False,
    **options: Unpack[RunOptions],
) -> StyleMeshTexture:
    """Optimizes a texture whose views look like an exemplar; writes a run folder with the texture in it.

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
    if not config.by_angle:
        reject_idle(options.get("set", ()), {"frontal"}, "without by_angle=true")
    target = Exemplar.of(exemplar).of_albedo()
    given = Mesh.of(mesh)
    surface = with_layout(given, config.resolution, keep_uvs)
    run.control.check()
    task = StyleMeshTask(config, target, surface)
    return run.train(
        task,
        target.name,
        lambda about: StyleMeshTexture(surface, task.texture.detach().numpy(), about),
        **config.schedule,
    )
