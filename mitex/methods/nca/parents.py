"""Models that a training starts from."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

from mitex.errors import CheckpointError
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.look import Look, differing_traits
from mitex.training.fit import Run
from mitex.training.locate import checkpoints, header


def fitting_lineage(parent: Look, about: Mapping[str, Any], look: Look) -> dict[str, str]:
    """Name and family of a parent, once it is sure that a look can have its weights.

    Raises:
        CheckpointError: their traits differ.
    """
    differing = differing_traits(parent, look)
    if differing:
        raise CheckpointError(
            f"model '{about['name']}' differs from the config in {', '.join(differing)}",
            "set channels, hidden, degree, aggregation and the decoder alike, for an exemplar with its maps",
        )
    return {"parent": str(about["name"]), "family": str(about["family"])}


def resumed_lineage(run: Run[NcaConfig]) -> dict[str, str]:
    """What a run that is resumed has begun from."""
    if not run.resume or run.folder is None:
        return {}
    heads = [head for path in checkpoints(run.folder) if (head := header(path))]
    texts = heads[0][1] if heads else {}
    return {key: texts[f"task.{key}"] for key in ("parent", "family") if f"task.{key}" in texts}
