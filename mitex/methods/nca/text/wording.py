"""How a training from words begins: its settings, its prompts, and a parent that has what it needs."""

from __future__ import annotations

from copy import deepcopy

import torch

from mitex.errors import ConfigError
from mitex.features.text_image import object_prompt
from mitex.features.text_model import model_folder
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.decoder import Decoder
from mitex.methods.nca.look import Look
from mitex.methods.nca.motion.start import check_field
from mitex.training.config import by_key
from mitex.training.settings import RunOptions

PRESET = "text"
SMALL = "text-words"  # for the model that ships with the package
PRESETS = (PRESET, SMALL, "text-paper")
MAPS = ("albedo", "height")


def worded(options: RunOptions, text: str, model: str | None, motion: str | None = None) -> RunOptions:
    """Options of a fit from words; where nothing else tells, the preset is the one for the model.

    Args:
        options: as given.
        text: what the texture is made of.
        model: of texts and images; None where it is not given.
        motion: vector field that the texture shall move along; None where it is not given.

    Raises:
        ConfigError: the settings name another text, model or motion.
        WeightsError: the model is named and not there.
    """
    given = by_key(options.get("set", ()))
    for key, value in {"text": text, "text_model": model, "motion": motion}.items():
        if value is not None and given.setdefault(key, value) != value:
            raise ConfigError(f"{key} is set to {given[key]} and to {value}", "give it once")
    elsewhere = options.get("config") or options.get("resume") or "preset" in given
    preset = options.get("preset")
    if not (preset or elsewhere):
        preset = PRESET if model_folder(given.get("text_model")) else SMALL
    return {**options, "set": given, "preset": preset}


def check(config: NcaConfig) -> None:
    """Refuses settings that a training from words cannot follow.

    Raises:
        ConfigError: they are for exemplars, or the texture shall move along what is no field of spheres.
    """
    if config.preset not in PRESETS:
        raise ConfigError(
            f"the preset {config.preset} is for exemplars, not for words", f"use one of {', '.join(PRESETS)}"
        )
    if config.motion:
        check_field(config.motion)
    if "flat" in config.surfaces:
        raise ConfigError("surfaces holds 'flat', which nobody has words for", "use even or uneven")
    if not (config.text or "").strip():
        raise ConfigError("the text is empty", "say what the texture is made of")


def prompts(config: NcaConfig, thing: str) -> tuple[str, str]:
    """What the model reads: of the texture on a thing, and of the thing without it (section 4.2)."""
    return object_prompt(config.text or "", thing, config.text_prompt), thing


def with_maps(look: Look, maps: tuple[str, ...]) -> Look:
    """A copy of a look that shows some of its maps alone, as it shows them.

    Raises:
        ConfigError: it does not have them all.
    """
    missing = [name for name in maps if name not in look.maps]
    if missing:
        raise ConfigError(f"the model has no {' and no '.join(missing)}", "start from one that has")
    columns = [column for name in maps for column in look.layout[name]]
    decoder, weights = look.decoder, look.state_dict()
    shape = decoder.shape if isinstance(decoder, Decoder) else None
    shown = Look(deepcopy(look.rule), maps, shape, look.mean)
    if isinstance(decoder, Decoder):
        last = f"decoder.network.layers.{len(decoder.network.layers) - 1}"
        for name in (f"{last}.weight", f"{last}.bias"):
            weights[name] = weights[name][torch.tensor(columns)]
    shown.load_state_dict(weights)
    return shown
