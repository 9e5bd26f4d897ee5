"""How a training of motion begins: its field, its settings, and a still look that learns to move."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from copy import deepcopy
from dataclasses import replace
from typing import Any

import numpy as np
import torch

from mitex.errors import ConfigError
from mitex.mesh import icosphere
from mitex.mesh.fields import vector_field
from mitex.methods.nca.config import PRESETS, NcaConfig
from mitex.methods.nca.look import Look
from mitex.methods.nca.model import MeshNCA
from mitex.methods.nca.motion.condition import WIDTH
from mitex.suffixes import names_field_file
from mitex.training.config import by_key
from mitex.training.settings import RunOptions

PRESET = "motion"


def motion_options(options: RunOptions, field: str) -> RunOptions:
    """Options of a fit whose texture moves along a field; the preset is `PRESET` where nothing else tells.

    Raises:
        ConfigError: the settings name another field, or it is called "none".
    """
    if field.strip().lower() in ("", "none"):
        raise ConfigError(f"'{field}' is no field to move along", "leave out `motion` for a still texture")
    settings = by_key(options.get("set", ()))
    if settings.setdefault("motion", field) != field:
        raise ConfigError(f"motion is set to {settings['motion']} and to {field}", "give it once")
    elsewhere = options.get("config") or options.get("resume") or "preset" in settings
    preset = options.get("preset") or (None if elsewhere else PRESET)
    return {**options, "set": settings, "preset": preset}


def presets_from(about: Mapping[str, Any], field: str | None) -> Mapping[str, NcaConfig]:
    """The presets for a training from a model, along a field if one is named.

    A pattern that learns to move keeps its size: `density` is the model's.
    """
    own = {"density": about["density"]} if "density" in about else {}
    return {name: replace(one, **own) if one.motion or field else one for name, one in PRESETS.items()}


def check_field(field: str) -> None:
    """Refuses what is no field of a training's spheres.

    Raises:
        ConfigError: it is unknown, or of one mesh alone.
    """
    if names_field_file(field):
        raise ConfigError(
            f"'{field}' is the field of one mesh, and the training has spheres of its own",
            "train with a name or a direction, and give the file as `field` when it is applied",
        )
    vector_field(icosphere(2), field)


def check_albedo(config: NcaConfig, maps: Iterable[str]) -> None:
    """Refuses a training that looks at the motion of pictures without an albedo, which they show.

    Raises:
        ConfigError: there is none among the maps.
    """
    if config.motion and config.motion_estimator != "advection" and "albedo" not in maps:
        raise ConfigError(
            "motion is measured in pictures of the albedo, which the exemplar does not have",
            "add one, or set motion_estimator=advection",
        )


def motion_record(config: NcaConfig) -> dict[str, Any]:
    """What the file of a texture tells of how it learned to move; nothing of a still one."""
    if not config.motion:
        return {}
    about: dict[str, Any] = {"motion": config.motion, "motion_period": config.motion_period}
    about |= {"motion_advection": config.motion_advection}
    return about | {"motion_speed": config.motion_speeds[1] * _longest(config.motion)}


def _longest(field: str) -> float:
    """Length of the longest vectors of a field on a sphere, whose mean length is 1."""
    return float(np.linalg.norm(vector_field(icosphere(8), field), axis=1).max())


def training_look(config: NcaConfig, look: Look) -> Look:
    """The look that a training starts from, whose cells take a vector if the settings want it."""
    return with_condition(look) if config.motion and config.motion_encoding else look


def with_condition(look: Look) -> Look:
    """A look whose cells take a vector: a copy for which it does not matter yet, if they are not so far.

    The weights of the new inputs are zero, so that it grows bit for bit what the look grows.
    """
    if look.rule.condition:
        return look
    look, still = deepcopy(look), look.rule
    rule = MeshNCA(still.channels, still.hidden, WIDTH, still.degree)
    weights = still.state_dict()
    first = weights["fc1.weight"]
    weights["fc1.weight"] = torch.cat([first, first.new_zeros(len(first), WIDTH)], 1)
    rule.load_state_dict(weights)
    look.rule = rule
    return look
