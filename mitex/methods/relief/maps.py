"""The maps that a relief begins with: a fit of `surface`, kept in the user's cache."""

from __future__ import annotations

import shutil
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from mitex.cache import cached, content_key
from mitex.exemplar import Exemplar
from mitex.mesh import Mesh
from mitex.methods import surface
from mitex.methods.relief.config import ReliefConfig
from mitex.methods.surface import SurfaceTexture
from mitex.paths import cache_dir
from mitex.training.control import Control
from mitex.training.locate import NAME, has_checkpoint

VERSION = "2"  # part of the keys; to be raised when the maps are synthesized in another way


def synthesized(
    exemplar: Exemplar, mesh: Mesh, config: ReliefConfig, keep_uvs: bool, control: Control, keep: bool
) -> SurfaceTexture:
    """The exemplar's maps on the mesh.

    Args:
        exemplar: maps.
        mesh: the mesh.
        config: settings.
        keep_uvs: use the mesh's own UVs.
        control: is told of the steps, and may stop them.
        keep: whether the result, and a fit that is stopped, are kept in the cache; other reliefs of the same
            maps find it there.

    Raises:
        MitexError, Interrupted: as `surface.fit`.
    """
    settings = config.of_surface
    key = content_key(VERSION, exemplar.key, mesh.vertices, mesh.faces, mesh.uv, keep_uvs, settings)
    place = cache_dir() / "relief" / key
    training = place.with_suffix(".run")
    begun = keep and has_checkpoint(training)
    options: dict[str, Any] = {"set": settings, "on_step": control.on_step, "cancel": control.cancel}

    def compute() -> SurfaceTexture:
        folder = training if keep else None
        texture = surface.fit(exemplar, mesh, folder, keep_uvs=keep_uvs, resume=begun, **options)
        # As files keep them, so that it does not matter whether they come from the cache.
        return replace(texture, values=texture.values.astype(np.float16).astype(np.float32))

    texture = cached(place, compute, SurfaceTexture.load, _write, keep)
    if keep:
        shutil.rmtree(training, ignore_errors=True)
    return texture


def _write(folder: Path, texture: SurfaceTexture) -> None:
    texture.save(folder / NAME)
