"""Fitting a relief: from exemplar and mesh to a texture file."""

from __future__ import annotations

from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Unpack

from mitex.exemplar import Exemplar
from mitex.mesh import Mesh
from mitex.mesh.self_intersections import piercing_pairs
from mitex.methods.layout import layout_ratio, with_layout
from mitex.methods.relief.config import PRESETS
from mitex.methods.relief.depth import with_depth
from mitex.methods.relief.maps import synthesized
from mitex.methods.relief.start import Start
from mitex.methods.relief.task import ReliefTask, inputs
from mitex.methods.relief.texture import ReliefTexture
from mitex.progress import announce
from mitex.training.fit import Run
from mitex.training.optim import Adam
from mitex.training.settings import RunOptions


def fit(
    exemplar: Exemplar | str | Path,
    mesh: Mesh | str | Path,
    out: str | Path | None = None,
    *,
    keep_uvs: bool = False,
    **options: Unpack[RunOptions],
) -> ReliefTexture:
    """Moves a mesh until its relief looks like an exemplar's; writes a run folder with the result in it.

    First `surface` synthesizes the exemplar's maps on the mesh, which are kept in the user's cache, and the
    height map becomes a relief. Then vertices move until close-ups of heights and normals, and of both with
    the colours, have the features of the exemplar.

    Args:
        exemplar: maps, or what `Exemplar.load` takes: a height map or normals, and colours if there are any.
        mesh: or what `Mesh.load` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        keep_uvs: use the mesh's own UVs.
        options: those of `RunOptions`.

    Returns:
        The relief, also saved as `texture.safetensors` in `out` if that is given. `about` says how deep it is
        (`depth`, in widths of the exemplar), and how many pairs of faces pierce each other (`piercing`), on
        the mesh itself `piercing_before`.

    Raises:
        MitexError: bad input of any kind; nothing has been written to `out` then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    run = Run.of(PRESETS, out, **options)
    config = run.config
    given = Mesh.of(mesh)
    loaded = Exemplar.of(exemplar)
    target, depth = with_depth(loaded, config.depth)
    run.check_inputs(inputs(target, given))
    run.control.check()
    if config.start == "flat":
        start = Start.flat(with_layout(given, config.resolution, keep_uvs), config)
    else:
        keep = run.folder is not None
        start = Start.of_maps(synthesized(target, given, config, keep_uvs, run.control, keep), config)
    ratio = layout_ratio(given, start.mesh, config.resolution, keep_uvs)
    task = ReliefTask(config, target, depth, replace(start, layout_ratio=ratio))

    def texture(about: dict) -> ReliefTexture:
        announce("looking for faces that pierce each other")
        moved = task.moved()
        pairs = {"piercing": len(piercing_pairs(moved)), "piercing_before": len(piercing_pairs(start.fine))}
        return ReliefTexture(start.mesh, start.fine, moved, start.textures, about | pairs | {"depth": depth})

    return run.train(
        task,
        target.name,
        texture,
        **config.schedule,
        optimizer=partial(Adam, shared=True),
    )
