"""Learning a geometric texture: from a reference mesh to a model file."""

from __future__ import annotations

import sys
from collections.abc import Sequence
from functools import partial
from pathlib import Path

import numpy as np
import torch

from mitex.cache import cached, content_key
from mitex.mesh import Mesh
from mitex.methods.geometric import files
from mitex.methods.geometric.config import PRESETS, GeometricConfig
from mitex.methods.geometric.hierarchy import Hierarchy
from mitex.methods.geometric.references import find_reference
from mitex.methods.geometric.report import FitReport, report
from mitex.methods.geometric.task import GeometricTask, betas, learning_rate
from mitex.methods.geometric.template import find_template, normalised
from mitex.methods.geometric.texture import GeometricTexture
from mitex.methods.geometric.training_meshes import fit_level
from mitex.paths import cache_dir
from mitex.runtime import keep_freed_memory
from mitex.training import run, train
from mitex.training.optim import Adam

VERSION = 1  # of the training meshes in the cache


def fit(
    reference: Mesh | str | Path,
    out: str | Path,
    *,
    template: Mesh | str | Path | None = None,
    preset: str | None = None,
    config: Path | None = None,
    overrides: Sequence[str] = (),
    resume: bool = False,
    quiet: bool = False,
) -> GeometricTexture:
    """Learns the geometric texture of a reference mesh; writes a run folder with the model in it.

    The training meshes of the levels are found first and kept in the user's cache folder.

    Args:
        reference: a mesh, what `Mesh.load` takes, or a name of `REFERENCES`.
        out: run folder; must be new or empty, or hold a run to `resume`.
        template: where the training meshes start from; None chooses by genus.
        preset: "fast" (default) or "paper".
        config: TOML file with any of `GeometricConfig`'s keys.
        overrides: `key=value`, for any key.
        resume: go on from the run's checkpoint, with its config as far as no other is given; with more
            `steps`, to further levels.
        quiet: show no progress.

    Returns:
        The texture, also saved as `geometry.safetensors` in `out`.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Interrupted: a checkpoint has been saved.
    """
    out = Path(out).expanduser()
    settings = run.settings(PRESETS, out, preset, config, overrides, resume)
    shape = reference if isinstance(reference, Mesh) else find_reference(reference)
    given = Mesh.load(template) if isinstance(template, str | Path) else template
    shape, start = normalised(shape, find_template(shape, given))
    keep_freed_memory()
    meshes, reports = training_meshes(shape, start, settings, quiet)
    hierarchy = Hierarchy.of(start, settings.levels)
    task = GeometricTask(settings, hierarchy, torch.from_numpy(start.vertices), meshes, shape)
    result = train(
        task,
        settings,
        out,
        lr=partial(learning_rate, settings),
        optimizer=partial(Adam, betas=betas(settings)),
        resume=resume,
        quiet=quiet,
    )
    about = result.about(shape.name, settings.preset)
    about |= {key: getattr(settings, key) for key in ("levels", "noise", "remeasure")}
    about["fit"] = [vars(r) for r in reports]
    texture = GeometricTexture(task.generators[: settings.levels], start, task.fixed, about)
    texture.save(out / files.NAME)
    return texture


def training_meshes(
    reference: Mesh, template: Mesh, config: GeometricConfig, quiet: bool = True
) -> tuple[list[torch.Tensor], list[FitReport]]:
    """Vertices (V, 3) of the training mesh of each level, from the cache where known, and how they fit.

    Args:
        reference, template: from `normalised`.
        config: settings.
        quiet: say nothing; else a line for each level goes to stderr.
    """
    hierarchy = Hierarchy.of(template, config.levels)
    options = [getattr(config, key) for key in vars(config) if key.startswith("fit_")]
    arrays = (reference.vertices, reference.faces, template.vertices, template.faces)
    found, reports = [], []
    for level, mesh in enumerate(hierarchy.meshes):
        place = cache_dir() / "geometric" / content_key(VERSION, *arrays, config.seed, *options, level)
        start = hierarchy.finer(found[-1], level - 1) if found else torch.from_numpy(template.vertices)

        def find(start: torch.Tensor = start, level: int = level) -> torch.Tensor:
            return fit_level(reference, start, hierarchy.graphs[level], level, config)

        found.append(cached(place, find, _read, _write))
        reports.append(report(mesh.with_vertices(found[-1].numpy() / 2**level), reference))
        if not quiet:
            print(f"training mesh {level}: {reports[-1]}", file=sys.stderr, flush=True)
    return found, reports


def _read(place: Path) -> torch.Tensor:
    return torch.from_numpy(np.load(place / "vertices.npy", allow_pickle=False))


def _write(folder: Path, vertices: torch.Tensor) -> None:
    np.save(folder / "vertices.npy", vertices.numpy(), allow_pickle=False)
