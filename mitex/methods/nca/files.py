"""Model files: the weights of a look and what it was trained on, as safetensors.

Both our own files (metadata says what the maps are) and the authors' weights (tensors fc1 and fc2, converted
to safetensors; all five maps are assumed, without a decoder) can be read, and a run folder stands for its
newest model.
"""

from __future__ import annotations

import json
from collections.abc import Mapping
from dataclasses import asdict
from pathlib import Path
from typing import Any

import torch

from mitex.errors import CheckpointError, ConfigError
from mitex.methods.nca import METHOD
from mitex.methods.nca.config import DECODER_KEYS, NcaConfig
from mitex.methods.nca.decoder.decoder import Decoder
from mitex.methods.nca.decoder.shape import DecoderShape
from mitex.methods.nca.look import STATE_CHANNELS, Look, weights_key
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.motion.start import motion_record
from mitex.methods.nca.palette import Palette
from mitex.methods.nca.perception import HARMONICS
from mitex.paths import expanded
from mitex.reading import reading
from mitex.training import checkpoint, model_file
from mitex.training.config import of_record
from mitex.training.locate import CHECKPOINT, NAME, PREVIOUS, locate

REMEDY = "give a file written by mitex fit nca, or its run folder"
STATED = ("density", "motion", "motion_advection", "motion_period")  # settings that a description holds, too
RULE = "rule."  # before names of the rule's tensors, which files leave out


def save(path: Path, look: Look, about: Mapping[str, Any]) -> Path:
    """Writes weights and `about` (JSON values; `name` at least).

    Raises:
        OutputError: the place is not writable.
    """
    tensors = {name.removeprefix(RULE): value for name, value in look.state_dict().items()}
    metadata = {"degree": str(look.rule.degree), "aggregation": "mean" if look.mean else "sum"}
    if isinstance(look.decoder, Decoder):
        metadata["decoder"] = json.dumps(asdict(look.decoder.shape))
    return model_file.save(path, tensors, METHOD.name, {**about, "maps": list(look.maps)}, **metadata)


def load(source: str | Path) -> tuple[Look, dict[str, Any]]:
    """Reads a look by file, run folder or bundled name.

    Returns:
        The look, and what is known about it; `maps`, `name` and `family` are always there. The family of a
        look that was trained from nothing is its own weights' hash, which those trained from it inherit.

    Raises:
        CheckpointError: nothing there, not a model, or weights of an impossible shape.
    """
    path = _newest(source)
    with reading(path, CheckpointError, REMEDY, "does not hold a MeshNCA model", also=(ConfigError,)):
        return _read(path, source)


def _read(path: Path, source: str | Path) -> tuple[Look, dict[str, Any]]:
    if path.name in (CHECKPOINT, PREVIOUS):
        # Of a run folder any readable checkpoint will do; a file is read as it was named.
        folder = expanded(source).is_dir()
        return _from_checkpoint(checkpoint.load(path.parent) if folder else checkpoint.read(path), path)
    tensors, metadata = model_file.read(path)
    about = _about(metadata, path)
    rule = _rule(tensors, metadata.get("degree"), path)
    shape = _shape(metadata["decoder"], path) if "decoder" in metadata else None
    look = Look(rule, _maps(about["maps"], rule, shape, path), shape, metadata.get("aggregation") == "mean")
    own = {RULE + name if name in METHOD.tensors else name: value for name, value in tensors.items()}
    bounds = {name: getattr(look, name) for name in ("low", "high")}  # which the authors' weights lack
    _fill(look, bounds | own, path)
    return look, {"family": weights_key(look)} | about


def _from_checkpoint(state: checkpoint.Checkpoint, path: Path) -> tuple[Look, dict[str, Any]]:
    maps = state.metadata.get("maps", "albedo").split(",")
    about: dict[str, Any] = {"name": state.metadata.get("exemplar", path.parent.name), "maps": maps}
    config = of_record(NcaConfig, state.config)
    about |= {
        "steps": state.step,
        "preset": config.preset,
        "density": config.density,
        **motion_record(config),
    }
    look = Look.of(config, maps)
    _fill(look, {k[6:]: v for k, v in state.task.items() if k.startswith("model.")}, path)
    return look, {"family": state.metadata.get("family", weights_key(look))} | about


def _shape(text: str, path: Path) -> DecoderShape:
    """The shape of a decoder, within the limits of the settings."""
    try:
        parts = json.loads(text)
        if parts.keys() != set(DECODER_KEYS.values()):
            raise ValueError(f"parts {', '.join(parts)}")
        return of_record(NcaConfig, {key: parts[part] for key, part in DECODER_KEYS.items()}).decoder_shape
    except (ConfigError, ValueError, AttributeError, RecursionError) as e:
        raise CheckpointError(f"the decoder in '{path}' is damaged ({e})", "save the model again") from e


def _fill(module: torch.nn.Module, tensors: dict[str, torch.Tensor], path: Path) -> None:
    try:
        module.load_state_dict({name: value.float() for name, value in tensors.items()})
    except RuntimeError as e:
        raise CheckpointError(
            f"'{path}' does not hold a MeshNCA model", "give a file written by mitex fit nca"
        ) from e
    if not all(torch.isfinite(value).all() for value in module.state_dict().values()):
        raise CheckpointError(f"the weights in '{path}' are not finite", "train the model again")


def _newest(source: str | Path) -> Path:
    """The file to read; of a resumed run the checkpoint, which is newer than the model of its first part."""
    first, *others = locate(source)
    if first.name == NAME and others and others[0].name == CHECKPOINT:
        return max(first, others[0], key=lambda file: file.stat().st_mtime_ns)
    return first


def _about(metadata: dict[str, str], path: Path) -> dict[str, Any]:
    """What a file says about itself; without any maps they are the authors' five."""
    try:
        about = json.loads(metadata.get("about", "{}"))
        maps = sorted(about.get("maps", STATE_CHANNELS))
        if not all(isinstance(about.get(key, ""), str) for key in ("name", "family")):
            raise ValueError("a name that is no text")
        if "palette" in about:
            Palette.from_record(about["palette"])
            maps.index("albedo")  # which the palette is of
        of_record(NcaConfig, {key: about[key] for key in STATED if key in about})
    except (LookupError, ValueError, TypeError, AttributeError, RecursionError) as e:
        raise CheckpointError(f"the description in '{path}' is damaged ({e})", "save the model again") from e
    return {"name": path.stem} | about | {"maps": maps}


def _maps(maps: list[str], rule: MeshNCA, shape: DecoderShape | None, path: Path) -> list[str]:
    """The names, once it is sure that the look can have these maps."""
    unknown = [name for name in maps if name not in STATE_CHANNELS]
    if unknown or not maps:
        raise CheckpointError(f"'{path}' has unknown maps {unknown}", "it was written by another version")
    channels = 1 + max(channel for name in maps for channel in STATE_CHANNELS[name])
    if shape is None and channels > rule.channels:
        raise CheckpointError(
            f"the model in '{path}' has {rule.channels} channels, its maps need {channels}", "train it again"
        )
    return maps


def _rule(tensors: dict[str, torch.Tensor], degree: object, path: Path) -> MeshNCA:
    """A rule of the tensors' shape, without weights; `degree` of the harmonics if the file tells."""
    problem = CheckpointError(
        f"'{path}' does not hold a MeshNCA model", "give a file written by mitex fit nca"
    )
    weights = [tensors.get(name) for name in ("fc1.weight", "fc2.weight")]
    if any(weight is None or weight.ndim != 2 for weight in weights):
        raise problem
    (channels, hidden), (rows, inputs) = tensors["fc2.weight"].shape, tensors["fc1.weight"].shape
    if rows != hidden or not hidden:  # the network of the two would be larger than the file
        raise problem
    highest = _degree(degree, channels, inputs)
    if highest is None or not channels:
        raise problem
    return MeshNCA(channels, hidden, inputs - (HARMONICS[highest] + 1) * channels, highest)


def _degree(stated: object, channels: int, inputs: int) -> int | None:
    """Of the harmonics: what the file tells, else one that leaves no condition, else the authors' 1."""
    widths = {degree: (count + 1) * channels for degree, count in HARMONICS.items()}
    exact = [degree for degree, width in widths.items() if width == inputs]
    fitting = [degree for degree, width in widths.items() if width <= inputs]
    if stated is not None:
        return next((degree for degree in fitting if str(degree) == str(stated)), None)
    return next(iter(exact or [degree for degree in (1, 0) if degree in fitting]), None)
