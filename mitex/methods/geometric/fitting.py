"""Learning a geometric texture: from a reference mesh to a model file."""

from __future__ import annotations

import logging
from functools import partial
from pathlib import Path
from typing import Unpack

import numpy as np
import torch

from mitex.cache import cached, content_key
from mitex.errors import ConfigError
from mitex.mesh import Mesh
from mitex.mesh.fields import vector_field
from mitex.mesh.low_pass import blurred
from mitex.methods.geometric.coarse_relief import CoarseRelief, Start, split
from mitex.methods.geometric.config import PRESETS, GeometricConfig
from mitex.methods.geometric.directions import level_fields
from mitex.methods.geometric.files import LINE, VECTOR
from mitex.methods.geometric.hierarchy import Hierarchy
from mitex.methods.geometric.references import find_reference
from mitex.methods.geometric.report import FitReport, report
from mitex.methods.geometric.task import GeometricTask, betas, inputs, learning_rate
from mitex.methods.geometric.template import find_template, normalised
from mitex.methods.geometric.texture import GeometricTexture
from mitex.methods.geometric.training_meshes import fit_level
from mitex.paths import cache_dir
from mitex.progress import counted, listening
from mitex.runtime import keep_freed_memory
from mitex.training.control import ALONE, Control
from mitex.training.fit import Run
from mitex.training.optim import Adam
from mitex.training.settings import RunOptions

VERSION = 1  # of the training meshes in the cache
LAID = 24  # coarse reliefs that samples of a training start from
log = logging.getLogger(__name__)


def fit(
    reference: Mesh | str | Path,
    out: str | Path | None = None,
    *,
    template: Mesh | str | Path | None = None,
    field: str | Path | np.ndarray | None = None,
    **options: Unpack[RunOptions],
) -> GeometricTexture:
    """Learns the geometric texture of a reference mesh; writes a run folder with the model in it.

    The training meshes of the levels are computed first and kept in the user's cache folder.

    Args:
        reference: a mesh, what `Mesh.load` takes, or a name of `REFERENCES`.
        out: run folder; must be new or empty, or hold a run to resume (with more `steps`, to further levels).
            None writes no file.
        template: where the training meshes start from; None chooses by genus.
        field: the vector field on the reference that its relief follows, see `mitex.mesh.fields`; the texture
            then needs one wherever it is grown. With `symmetric` among the settings, a vector and its
            opposite are the same. None for a relief without a direction.
        options: preset ("fast", "paper", "fine" or "finest"), and those of `RunOptions`.

    Returns:
        The texture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    run = Run.of(PRESETS, out, **options)
    config = run.config
    shape = reference if isinstance(reference, Mesh) else find_reference(reference)
    template = None if template is None else Mesh.of(template)
    if field is None and config.symmetric:
        raise ConfigError("a relief without a `field` has no ends that look alike", "leave `symmetric` out")
    vectors = None if field is None else vector_field(shape, field)
    shape, start = normalised(shape, find_template(shape, template))
    source = inputs(shape, start, vectors)
    run.check_inputs(source)
    keep_freed_memory()
    meshes, reports = training_meshes(shape, start, config, run.control, keep=run.folder is not None)
    fields = [] if vectors is None else _fields(shape, vectors, start, meshes)[config.first_level :]
    relief = None
    if config.first_level:
        start, meshes, relief = _from_level(start, meshes, fields, config, run.control)
    hierarchy = Hierarchy.of(start, config.levels)
    if fields:
        hierarchy = hierarchy.directed(fields, config.symmetric)
    task = GeometricTask(config, hierarchy, torch.tensor(start.vertices), meshes, shape, source, relief)
    origin = {key: getattr(config, key) for key in ("levels", "noise", "remeasure", "first_level")}
    origin |= {"field": field_kind(vectors, config.symmetric), "fit": [vars(r) for r in reports]}
    return run.train(
        task,
        shape.name,
        lambda about: GeometricTexture(
            [generator.to("cpu") for generator in task.generators[: config.levels]],
            start,
            task.fixed.cpu(),
            about | origin,
            fields,
        ),
        lr=partial(learning_rate, config),
        optimizer=partial(Adam, betas=betas(config)),
    )


def _fields(
    reference: Mesh, vectors: np.ndarray, template: Mesh, meshes: list[torch.Tensor]
) -> list[torch.Tensor]:
    """The reference's field (V, 3) on the training mesh of each level."""
    levels = enumerate(zip(Hierarchy.of(template, len(meshes)).meshes, meshes, strict=True))
    placed = [mesh.with_vertices(vertices.numpy() / 2**level) for level, (mesh, vertices) in levels]
    return level_fields(reference, vectors, placed)


def _from_level(
    template: Mesh,
    meshes: list[torch.Tensor],
    fields: list[torch.Tensor],
    config: GeometricConfig,
    control: Control,
) -> tuple[Mesh, list[torch.Tensor], Start]:
    """What a training that begins on `first_level` has for its template and training meshes.

    Returns:
        The training mesh of that level without its relief, mean edge 1, those from that level on, and what
        the training begins with.
    """
    level = config.first_level
    finest = Hierarchy.of(template, level + 1).meshes[-1]
    whole = split(finest.with_vertices(meshes[level].numpy()))
    unit = float(whole.base.edge_lengths.mean())
    base = whole.base.with_vertices(whole.base.vertices / unit)
    field = fields[0].numpy() if fields else None
    coarse = CoarseRelief(base, whole.heights / unit, field, config.symmetric)
    lay = coarse.on(base, field)
    laid = []
    for k in counted("laying coarse reliefs", range(LAID), LAID):
        control.check()
        with listening(None):
            laid.append(lay(config.seed + k))
    start = Start(coarse.displacements, laid)
    return base, [vertices / unit for vertices in meshes[level:]], start


def field_kind(field: np.ndarray | None, symmetric: bool) -> str | None:
    """What a model file says of the field: "vector", or "line" if a vector and its opposite are the same."""
    if field is None:
        return None
    return LINE if symmetric else VECTOR


def training_meshes(
    reference: Mesh,
    template: Mesh,
    config: GeometricConfig,
    control: Control = ALONE,
    keep: bool = True,
) -> tuple[list[torch.Tensor], list[FitReport]]:
    """Vertices (V, 3) of the training mesh of each level, from the cache where it has them, and how they fit.

    With `fit_blur`, each is of the reference without what is too small for its edges.

    Args:
        reference, template: from `normalised`.
        config: settings.
        control: may stop the work before each level.
        keep: whether meshes that had to be computed are kept in the cache.

    Raises:
        Cancelled: by `control`.
    """
    hierarchy = Hierarchy.of(template, config.first_level + config.levels)
    options = {key: value for key, value in vars(config).items() if key.startswith("fit_")}
    arrays = (reference.vertices, reference.faces, template.vertices, template.faces)
    meshes, reports = [], []
    for level, mesh in enumerate(hierarchy.meshes):
        control.check()
        place = cache_dir() / "geometric" / content_key(VERSION, *arrays, (config.seed, options, level))
        start = hierarchy.finer(meshes[-1], level - 1) if meshes else torch.tensor(template.vertices)

        target = blurred(reference, config.fit_blur / 2**level)

        def compute(start: torch.Tensor = start, level: int = level, target: Mesh = target) -> torch.Tensor:
            return fit_level(target, start, hierarchy.graphs[level], level, config)

        meshes.append(cached(place, compute, _read, _write, keep))
        reports.append(report(mesh.with_vertices(meshes[-1].numpy() / 2**level), target))
        log.info("training mesh %d: %s", level, reports[-1])
    return meshes, reports


def _read(place: Path) -> torch.Tensor:
    return torch.from_numpy(np.load(place / "vertices.npy", allow_pickle=False))


def _write(folder: Path, vertices: torch.Tensor) -> None:
    np.save(folder / "vertices.npy", vertices.numpy(), allow_pickle=False)
