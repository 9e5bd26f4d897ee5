"""How a training from words begins: its settings, its prompts, and a parent that has what it needs."""

from __future__ import annotations

from copy import deepcopy

import torch

from mitex.errors import ConfigError
from mitex.features.text_image import object_prompt
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.decoder import Decoder
from mitex.methods.nca.look import Look
from mitex.training.config import by_key
from mitex.training.settings import RunOptions

PRESET = "text"
PRESETS = (PRESET, "text-paper")
MAPS = ("albedo", "height")


def worded(options: RunOptions, text: str, model: str | None) -> RunOptions:
    """Options of a fit from words; the preset is `PRESET` where nothing else tells.

    Args:
        options: as given.
        text: what the texture is made of.
        model: of texts and images; None where it is not given.

    Raises:
        ConfigError: the settings name another text or another model.
    """
    given = by_key(options.get("set", ()))
    for key, value in {"text": text, "text_model": model}.items():
        if value is not None and given.setdefault(key, value) != value:
            raise ConfigError(f"{key} is set to {given[key]} and to {value}", "give it once")
    elsewhere = options.get("config") or options.get("resume") or "preset" in given
    preset = options.get("preset") or (None if elsewhere else PRESET)
    return {**options, "set": given, "preset": preset}


def check(config: NcaConfig) -> None:
    """Refuses settings that a training from words cannot follow.

    Raises:
        ConfigError: they are for exemplars, or of a texture that moves.
    """
    if config.preset not in PRESETS:
        raise ConfigError(
            f"the preset {config.preset} is for exemplars, not for words", f"use {' or '.join(PRESETS)}"
        )
    if config.motion:
        raise ConfigError("a texture from words cannot learn to move", "leave out the motion")
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
