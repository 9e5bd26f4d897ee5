"""Capturing a texture: from photos to a model file."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Unpack

import numpy as np

from mitex.mesh import Mesh
from mitex.methods.nerf import files
from mitex.methods.nerf.base.base_shape import face_frames
from mitex.methods.nerf.base.coarse import BaseShape, find_base
from mitex.methods.nerf.capture.capture import Capture, load_capture
from mitex.methods.nerf.config import PRESETS
from mitex.methods.nerf.field.projection import Projection
from mitex.methods.nerf.field.shell import shell_reach
from mitex.methods.nerf.texture import NerfTexture
from mitex.methods.nerf.training.radiance import schedule
from mitex.methods.nerf.training.task import TextureTask
from mitex.progress import announce
from mitex.runtime import init, keep_freed_memory
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    capture: Capture | str | Path,
    out: str | Path | None = None,
    *,
    base_mesh: Mesh | str | Path | None = None,
    **options: Unpack[RunOptions],
) -> NerfTexture:
    """Learns a surface with its meso-structure from photos; writes a run folder with the model in it.

    Every eighth view is held out; previews show the first of these. The base shape is made first and kept in
    the user's cache folder.

    Args:
        capture: photos with masks and cameras, or the folder that `load_capture` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        base_mesh: the shape without its texture, in the capture's world; None finds it.
        options: preset ("fast" or "paper"), and those of `RunOptions`.

    Returns:
        The texture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    run = Run.of(PRESETS, out, **options)
    config = run.config
    photos = capture if isinstance(capture, Capture) else load_capture(capture)
    if base_mesh is not None:
        base_mesh = Mesh.of(base_mesh)
        base_mesh = base_mesh.with_vertices(photos.similarity.apply(base_mesh.vertices))
    init(needs="ad")
    keep_freed_memory()
    training, held_out = photos.split()
    run.check_inputs(training.metadata())
    base = find_base(training, config, base_mesh, run.control, keep=run.folder is not None)
    announce("preparing the field")
    frames = face_frames(base.mesh)
    reach = shell_reach(base.thickness, config.occupancy)
    projection = Projection(base.mesh, neighbours=config.neighbours, repulsion=config.repulsion, reach=reach)
    task = TextureTask(config, training, (held_out, 0), projection, frames, base.thickness)
    origin: dict[str, Any] = {key: getattr(config, key) for key in files.SETTINGS}
    origin |= {"centre": photos.similarity.centre.tolist(), "scale": float(photos.similarity.scale)}
    return run.train(
        task,
        photos.name,
        lambda about: NerfTexture(_model(base, frames, task, about | origin)),
        **schedule(config),
    )


def _model(base: BaseShape, frames: np.ndarray, task: TextureTask, about: dict[str, Any]) -> files.Model:
    """The model of a training: base shape, running mean of the parameters, and occupied cells."""
    mean = task.mean
    return files.Model(
        base,
        frames,
        [mean["tables/f"], mean["tables/phase"]],
        [value for name, value in mean.items() if name.startswith("weights/")],
        mean["light"],
        task.occupancy.occupied,
        about,
    )
