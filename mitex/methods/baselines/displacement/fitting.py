"""Baking a displacement map: from a reference mesh to a model file."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from typing import Unpack

from mitex.mesh import Mesh
from mitex.methods.baselines.displacement import METHOD
from mitex.methods.baselines.displacement.config import PRESETS
from mitex.methods.baselines.displacement.texture import DisplacementMap
from mitex.methods.geometric.references import find_reference
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    reference: Mesh | str | Path, out: str | Path | None = None, **options: Unpack[RunOptions]
) -> DisplacementMap:
    """Bakes the relief of a mesh; writes a run folder with the map in it.

    Args:
        reference: a mesh, what `Mesh.load` takes, or a geometric texture's reference by its name; the map is
            taken off the side that faces +z.
        out: run folder; must be new or empty; None writes no file.
        options: those of `RunOptions` but `steps` and `resume`; `on_step` is not called.

    Returns:
        The map, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
    """
    run = Run.of(PRESETS, out, **options)
    mesh = reference if isinstance(reference, Mesh) else find_reference(reference)
    baked = DisplacementMap.bake(mesh, run.config.resolution, run.config.window)
    return run.compute(METHOD.name, mesh.name, lambda about: replace(baked, about=about), reference=mesh.name)
