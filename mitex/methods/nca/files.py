"""Model files: the weights of a cell rule and what it was trained on, as safetensors.

Both our own files (metadata says what the maps are) and the authors' weights (tensors fc1 and fc2, converted
to safetensors; all five maps are assumed) can be read, and a run folder stands for its newest model.
"""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import torch
from safetensors import SafetensorError

from mitex.errors import CheckpointError
from mitex.methods.nca import METHOD
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.perception import HARMONICS
from mitex.methods.nca.targets import STATE_CHANNELS
from mitex.training import checkpoint, model_file
from mitex.training.locate import CHECKPOINT, NAME, PREVIOUS, locate

PARAMETERS = METHOD.tensors


def save(path: Path, model: MeshNCA, about: dict[str, Any]) -> Path:
    """Writes weights and `about` (JSON values; `maps` and `name` at least).

    Raises:
        OutputError: the place is not writable.
    """
    return model_file.save(path, model.state_dict(), METHOD.name, about, degree=str(model.degree))


def load(source: str | Path) -> tuple[MeshNCA, dict[str, Any]]:
    """Reads a model by file, run folder or bundled name.

    Returns:
        The model, and what is known about it; `maps` and `name` are always there.

    Raises:
        CheckpointError: nothing there, not a model, or weights of an impossible shape.
    """
    path = _newest(source)
    if path.name in (CHECKPOINT, PREVIOUS):
        state = checkpoint.load(path.parent)
        tensors = {k[6:]: v for k, v in state.task.items() if k.startswith("model.")}
        maps = state.metadata.get("maps", "albedo").split(",")
        about: dict[str, Any] = {"name": state.metadata.get("exemplar", path.parent.name), "maps": maps}
        about |= {"steps": state.step, "preset": state.config.get("preset")}
        model = _model(tensors, state.config.get("degree"), path)
        return model, about | {"maps": _maps(maps, model, path)}
    try:
        tensors, metadata = model_file.read(path)
    except (SafetensorError, OSError, ValueError) as e:
        raise CheckpointError(f"'{path}' is not a model ({e})", "give a model file or a run folder") from e
    model = _model(tensors, metadata.get("degree"), path)
    return model, _about(metadata, model, path)


def _newest(source: str | Path) -> Path:
    """A resumed run's checkpoint is newer than the model of its first part."""
    first, *others = locate(source)
    if first.name == NAME and others and others[0].name == CHECKPOINT:
        return max(first, others[0], key=lambda file: file.stat().st_mtime_ns)
    return first


def _about(metadata: dict[str, str], model: MeshNCA, path: Path) -> dict[str, Any]:
    """What a file says about itself; without any maps they are the authors' five."""
    try:
        about = json.loads(metadata.get("about", "{}"))
        maps = sorted(about.get("maps", STATE_CHANNELS))
    except (ValueError, TypeError, AttributeError) as e:
        raise CheckpointError(f"the description in '{path}' is damaged ({e})", "save the model again") from e
    return {"name": path.stem} | about | {"maps": _maps(maps, model, path)}


def _maps(maps: list[str], model: MeshNCA, path: Path) -> list[str]:
    """The names, once it is sure that the model's state shows these maps."""
    unknown = [name for name in maps if name not in STATE_CHANNELS]
    if unknown or not maps:
        raise CheckpointError(f"'{path}' has unknown maps {unknown}", "it was written by another version")
    channels = 1 + max(channel for name in maps for channel in STATE_CHANNELS[name])
    if channels > model.channels:
        raise CheckpointError(
            f"the model in '{path}' has {model.channels} channels, its maps need {channels}", "train it again"
        )
    return maps


def _model(tensors: dict[str, torch.Tensor], degree: object, path: Path) -> MeshNCA:
    """The model whose shape the tensors have; `degree` of the harmonics if the file tells."""
    problem = CheckpointError(
        f"'{path}' does not hold a MeshNCA model", "give a file written by mitex fit nca"
    )
    if set(tensors) != PARAMETERS or any(tensors[k].ndim != 2 - k.endswith("bias") for k in PARAMETERS):
        raise problem
    (channels, hidden), inputs = tensors["fc2.weight"].shape, tensors["fc1.weight"].shape[1]
    rule_degree = _degree(degree, channels, inputs)
    if rule_degree is None or not channels:
        raise problem
    condition = inputs - (HARMONICS[rule_degree] + 1) * channels
    model = MeshNCA(channels, hidden, condition, rule_degree)
    try:
        model.load_state_dict({name: value.float() for name, value in tensors.items()})
    except RuntimeError as e:
        raise problem from e
    if not all(torch.isfinite(value).all() for value in model.state_dict().values()):
        raise CheckpointError(f"the weights in '{path}' are not finite", "train the model again")
    return model


def _degree(stated: object, channels: int, inputs: int) -> int | None:
    """Of the harmonics: what the file tells, else one that leaves no condition, else the authors' 1."""
    widths = {degree: (count + 1) * channels for degree, count in HARMONICS.items()}
    exact = [degree for degree, width in widths.items() if width == inputs]
    fitting = [degree for degree, width in widths.items() if width <= inputs]
    if stated is not None:
        return next((degree for degree in fitting if str(degree) == str(stated)), None)
    return next(iter(exact or [degree for degree in (1, 0) if degree in fitting]), None)
