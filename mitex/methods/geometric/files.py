"""Model files: the generators of all trained levels, and the template that they started from."""

from __future__ import annotations

import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError, safe_open
from safetensors.torch import save_file

from mitex.errors import CheckpointError
from mitex.mesh import Mesh
from mitex.methods.geometric.model import network
from mitex.methods.geometric.network import FaceNetwork
from mitex.paths import atomic_write

NAME = "geometry.safetensors"
FORMAT = "mitex-geometric-1"


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
        f"{level}/{k}": value.detach().contiguous()
        for level, generator in enumerate(generators)
        for k, value in enumerate(generator.parameters)
    }
    tensors |= {"vertices": torch.from_numpy(template.vertices), "faces": torch.from_numpy(template.faces)}
    tensors["fixed"] = fixed.contiguous()
    with atomic_write(path) as temporary:
        save_file(tensors, temporary, {"format": FORMAT, "about": json.dumps(dict(about))})
    return path


def load(source: str | Path) -> tuple[list[FaceNetwork], Mesh, torch.Tensor, dict[str, Any]]:
    """Reads a model file, or that of a run folder: generators, template, noise, and what is known of it.

    Raises:
        CheckpointError: there is none, or it is damaged.
    """
    path = Path(source).expanduser()
    path = path / NAME if path.is_dir() else path
    if not path.is_file():
        raise CheckpointError(
            f"there is no finished geometric texture at '{source}'", "go on with mitex fit geometric --resume"
        )
    try:
        with safe_open(path, "pt") as file:
            metadata = file.metadata() or {}
            tensors = {key: file.get_tensor(key) for key in file.keys()}  # noqa: SIM118 (not a mapping)
        if metadata.get("format") != FORMAT:
            raise ValueError("another format")
        about = json.loads(metadata["about"])
        template = Mesh(
            tensors["vertices"].numpy(), tensors["faces"].numpy(), name=f"{about['name']} template"
        )
        if not all(tensor.isfinite().all() for tensor in tensors.values()):
            raise ValueError("values that are not finite")
        if tensors["fixed"].shape != tensors["vertices"].shape:
            raise ValueError("noise of another template")
        return _generators(tensors, int(about["levels"])), template, tensors["fixed"], about
    except (SafetensorError, OSError, ValueError, KeyError, TypeError, RuntimeError) as e:
        raise CheckpointError(
            f"'{path}' is not a geometric texture ({e})", "name the run folder of mitex fit geometric"
        ) from e


def _generators(tensors: Mapping[str, torch.Tensor], levels: int) -> list[FaceNetwork]:
    generators = []
    for level in range(levels):
        generator = network(level, 3, torch.Generator())
        generator.load([tensors[f"{level}/{k}"] for k in range(len(generator.parameters))])
        generators.append(generator)
    return generators
