"""How a training from words begins: its settings, its prompts, and a parent that has what it needs."""

from __future__ import annotations

from copy import deepcopy

import torch

from mitex.errors import ConfigError
from mitex.features.text_image import object_prompt
from mitex.methods.nca.config import NcaConfig
from mitex.methods.nca.decoder.decoder import Decoder
from mitex.methods.nca.look import Look
from mitex.methods.nca.motion.start import check_field
from mitex.methods.words.wording import check_text

MAPS = ("albedo", "height")


def check(config: NcaConfig) -> None:
    """Refuses settings that a training from words cannot follow.

    Raises:
        ConfigError: they are for exemplars, or the texture shall move along what is no field of spheres.
    """
    check_text(config.text, config.preset)
    if config.motion:
        check_field(config.motion)
    if "flat" in config.surfaces:
        raise ConfigError("surfaces holds 'flat', which nobody has words for", "use even or uneven")


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
