"""Model files: the generators of all trained levels, and the template that they started from."""

from __future__ import annotations

import math
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch

from mitex.mesh import Mesh
from mitex.methods.geometric import METHOD
from mitex.methods.geometric.model import network
from mitex.methods.geometric.network import FaceNetwork
from mitex.training import model_file


def save(
    path: Path,
    generators: list[FaceNetwork],
    template: Mesh,
    fixed: torch.Tensor,
    about: Mapping[str, Any],
) -> Path:
    """Writes weights, template, the noise of the reconstruction and `about` (JSON values).

    Raises:
        OutputError: the place is not writable.
    """
    tensors = {
        f"{level}/{k}": value
        for level, generator in enumerate(generators)
        for k, value in enumerate(generator.parameters)
    }
    tensors |= {"vertices": torch.tensor(template.vertices), "faces": torch.tensor(template.faces)}
    tensors["fixed"] = fixed
    return model_file.save(path, tensors, METHOD.name, about)


def load(source: str | Path) -> tuple[list[FaceNetwork], Mesh, torch.Tensor, dict[str, Any]]:
    """Reads a model by file, run folder or bundled name: generators, template, noise, and `about`.

    Raises:
        CheckpointError: there is none, or it is damaged.
    """
    with model_file.opened(source, METHOD.name) as (tensors, about):
        template = Mesh(
            tensors["vertices"].numpy(), tensors["faces"].numpy(), name=f"{about['name']} template"
        )
        if not all(tensor.isfinite().all() for tensor in tensors.values()):
            raise ValueError("values that are not finite")
        if tensors["fixed"].shape != tensors["vertices"].shape:
            raise ValueError("noise of another template")
        if not 0 <= float(about["noise"]) < math.inf or not isinstance(about["remeasure"], bool):
            raise ValueError("noise that is no number, or features of another kind")
        return _generators(tensors, int(about["levels"])), template, tensors["fixed"], about


def _generators(tensors: Mapping[str, torch.Tensor], levels: int) -> list[FaceNetwork]:
    generators = []
    for level in range(levels):
        generator = network(level, 3, torch.Generator())
        generator.load([tensors[f"{level}/{k}"] for k in range(len(generator.parameters))])
        generators.append(generator)
    return generators
