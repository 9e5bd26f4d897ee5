"""Model files: tensors, the name of a format and a description as JSON, in one safetensors file."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import torch
from safetensors import safe_open
from safetensors.torch import save_file

from mitex.errors import CheckpointError, ConfigError, MeshError
from mitex.paths import atomic_write
from mitex.reading import reading
from mitex.training.locate import CHECKPOINT, PREVIOUS, locate


def save(
    path: str | Path, tensors: Mapping[str, torch.Tensor], kind: str, about: Mapping[str, Any], **further: str
) -> Path:
    """Writes what a method made: `kind` is its name, `about` holds JSON values, `further` is more metadata.

    Raises:
        OutputError: the place is not writable.
    """
    own = {name: value.detach().cpu().contiguous() for name, value in tensors.items()}
    metadata = {"format": _format(kind), "about": json.dumps(dict(about)), **further}
    with atomic_write(path) as temporary:
        save_file(own, temporary, metadata)
    return Path(path)


@contextmanager
def opened(source: str | Path, kind: str) -> Iterator[tuple[dict[str, torch.Tensor], dict[str, Any]]]:
    """Yields tensors and `about` of a model file, a finished run folder, or a bundled model by its name.

    What goes wrong in the body for lack of good tensors (a missing key, a wrong shape, a mesh of bad indices)
    means a damaged file.

    Raises:
        CheckpointError: there is none, or it is damaged.
    """
    path = locate(source)[0]
    if path.name in (CHECKPOINT, PREVIOUS):
        raise CheckpointError(
            f"there is no finished {kind} texture at '{source}'", "finish its fit, which can be resumed"
        )
    remedy = f"name the run folder of a {kind} fit"
    with reading(path, CheckpointError, remedy, f"is not a {kind} texture", also=(MeshError, ConfigError)):
        tensors, metadata = read(path)
        if metadata.get("format") != _format(kind):
            raise ValueError("another format")
        yield tensors, _description(metadata["about"])


def read(path: Path) -> tuple[dict[str, torch.Tensor], dict[str, str]]:
    """Tensors, in memory of their own, and metadata of any safetensors file.

    Raises:
        SafetensorError, OSError, ValueError: it is missing or damaged.
    """
    with safe_open(path, "pt") as file:
        most = path.stat().st_size
        for name in file.keys():  # noqa: SIM118
            # Only a tensor without elements can have such a side; what is built beside it would be huge.
            if max(file.get_slice(name).get_shape(), default=0) > most:
                raise ValueError(f"tensor {name} is larger than the file")
        return {key: file.get_tensor(key) for key in file.keys()}, file.metadata() or {}  # noqa: SIM118


def of_shapes(
    tensors: Mapping[str, torch.Tensor], shapes: Mapping[str, tuple[int, ...]]
) -> dict[str, torch.Tensor]:
    """The tensors in the order of their `shapes`.

    Raises:
        ValueError: other names or shapes, or values that are not finite.
    """
    if {name: tuple(value.shape) for name, value in tensors.items()} != dict(shapes):
        raise ValueError("tensors are missing, or of another shape")
    if not all(value.isfinite().all() for value in tensors.values()):
        raise ValueError("values that are not finite")
    return {name: tensors[name] for name in shapes}


def _description(text: str) -> dict[str, Any]:
    about = json.loads(text)
    if not isinstance(about.get("name", ""), str):
        raise ValueError("a name that is no text")
    return about


def _format(kind: str) -> str:
    return f"mitex-{kind}-1"
