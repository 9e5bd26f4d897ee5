"""Learning a texture: the image-guided training from exemplar to model file."""

from __future__ import annotations

from dataclasses import asdict
from pathlib import Path
from typing import Any, Unpack

from mitex.errors import CheckpointError
from mitex.exemplar import Exemplar
from mitex.methods.nca import files
from mitex.methods.nca.config import PRESETS, NcaConfig
from mitex.methods.nca.decoder.decoder import Decoder
from mitex.methods.nca.look import Look
from mitex.methods.nca.palette import Palette
from mitex.methods.nca.settling import settling_steps
from mitex.methods.nca.task import NcaTask
from mitex.methods.nca.texture import NcaTexture
from mitex.training.fit import Run
from mitex.training.settings import RunOptions


def fit(
    exemplar: Exemplar | str | Path,
    out: str | Path | None = None,
    *,
    init: str | Path | None = None,
    **options: Unpack[RunOptions],
) -> NcaTexture:
    """Trains a MeshNCA on an exemplar; writes a run folder with the texture in it.

    Args:
        exemplar: maps, or what `Exemplar.load` takes.
        out: run folder; must be new or empty, or hold a run to resume; None writes no file.
        init: model to start from: the parent, if the two shall be graftable (section 4.4).
        options: preset ("patch" or "paper"), and those of `RunOptions`.

    Returns:
        The texture, also saved as `texture.safetensors` in `out` if that is given.

    Raises:
        MitexError: bad input of any kind; nothing has been written then.
        Cancelled: by `cancel`; a checkpoint has been saved if there is a folder.
        Interrupted: by Ctrl-C, likewise.
    """
    run = Run.of(PRESETS, out, **options)
    config = run.config
    maps = exemplar if isinstance(exemplar, Exemplar) else Exemplar.load(exemplar)
    origin: dict[str, Any] = {"exemplar": maps.name, "density": config.density}
    if "albedo" in maps.maps:
        origin["palette"] = Palette.of(maps.maps["albedo"]).record()
    parent = None
    if init is not None:
        parent, about = _parent(init, config, sorted(maps.maps))
        origin["parent"] = str(about["name"])
    task = NcaTask(config, maps, parent)

    def texture(about: dict[str, Any]) -> NcaTexture:
        look = task.look.to("cpu")
        steps = settling_steps(look, task.exemplar, config.density)
        return NcaTexture(look, about | origin | {"growth_steps": steps})

    return run.train(
        task,
        maps.name,
        texture,
        lr=config.lr,
        milestones=config.milestones,
        decay=config.decay,
        normalise_gradients=config.normalise_gradients,
    )


def _parent(init: str | Path, config: NcaConfig, maps: list[str]) -> tuple[Look, dict[str, Any]]:
    parent, about = files.load(init)
    theirs, ours = (_traits(look) for look in (parent, Look.of(config, maps)))
    differing = sorted(name for name in theirs | ours if theirs.get(name) != ours.get(name))
    if differing:
        raise CheckpointError(
            f"model '{about['name']}' differs from the config in {', '.join(differing)}",
            "set channels, hidden, degree, aggregation and the decoder alike, for an exemplar with its maps",
        )
    return parent, about


def _traits(look: Look) -> dict[str, Any]:
    """What two looks must have in common for the weights of one to mean the same in the other."""
    traits: dict[str, Any] = {"maps": look.maps, "aggregation": look.mean}
    traits |= {name: tuple(value.shape) for name, value in look.state_dict().items()}
    return traits | (asdict(look.decoder.shape) if isinstance(look.decoder, Decoder) else {})
