"""Model files: the generators of all trained levels, and the template that they started from."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

import torch

from mitex.mesh import Mesh
from mitex.mesh.topology import face_edges
from mitex.methods.geometric import METHOD
from mitex.methods.geometric.config import MAX_LEVELS
from mitex.methods.geometric.model import network
from mitex.methods.geometric.network import FaceNetwork
from mitex.training import model_file

VECTOR, LINE = "vector", "line"  # what `field` in a model's `about` may be, if it is not None


def save(
    path: Path,
    generators: list[FaceNetwork],
    template: Mesh,
    fixed: torch.Tensor,
    about: Mapping[str, Any],
    fields: Sequence[torch.Tensor] = (),
) -> Path:
    """Writes weights, template, noise of the reconstruction, `about` (JSON values), the template's fields.

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
    tensors |= {f"field/{level}": field for level, field in enumerate(fields)}
    return model_file.save(path, tensors, METHOD.name, about)


def load(
    source: str | Path,
) -> tuple[list[FaceNetwork], Mesh, torch.Tensor, dict[str, Any], list[torch.Tensor]]:
    """Reads a model by file, run folder or bundled name: generators, template, noise, `about`, and the
    template's field on each level, none if the relief has no direction.

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
        # Models of before have none of the keys that are taken by `get`.
        levels, kind, first = int(about["levels"]), about.get("field"), int(about.get("first_level", 0))
        if not 0 <= first < MAX_LEVELS:
            raise ValueError("levels that cannot be")
        if kind not in (None, VECTOR, LINE):
            raise ValueError("a field of another kind")
        fields = [tensors[f"field/{level}"] for level in range(levels)] if kind else []
        counts = _vertex_counts(template, len(fields))
        if any(field.shape != (count, 3) for field, count in zip(fields, counts, strict=True)):
            raise ValueError("a field of another template")
        generators = _generators(tensors, range(first, first + levels), bool(kind))
        return generators, template, tensors["fixed"], about, fields


def _vertex_counts(mesh: Mesh, levels: int) -> list[int]:
    """How many vertices a mesh has on each level: a split adds one for each edge."""
    vertices, faces, counts = len(mesh.vertices), len(mesh.faces), []
    edges = len(face_edges(mesh.faces, vertices)[0])
    for _ in range(levels):
        counts.append(vertices)
        vertices, edges, faces = vertices + edges, 2 * edges + 3 * faces, 4 * faces
    return counts


def _generators(tensors: Mapping[str, torch.Tensor], levels: range, directed: bool) -> list[FaceNetwork]:
    generators = []
    for place, level in enumerate(levels):
        generator = network(level, 3, torch.Generator(), directed)
        generator.load([tensors[f"{place}/{k}"] for k in range(len(generator.parameters))])
        generators.append(generator)
    return generators
