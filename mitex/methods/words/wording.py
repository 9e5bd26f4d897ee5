"""How fits from words begin: their settings, and the preset that suits the vision-language model."""

from __future__ import annotations

from collections.abc import Collection, Mapping

from mitex.errors import ConfigError
from mitex.training.config import by_key
from mitex.training.settings import RunOptions

CLIP = "text"  # preset for CLIP models
EMBEDDED = "text-words"  # for the model that ships with the package
PAPER = "text-paper"
PRESETS = (CLIP, EMBEDDED, PAPER)


def words_options(options: RunOptions, inputs: Mapping[str, str | None]) -> RunOptions:
    """Options of a fit from words; where nothing else tells, the preset is the one for the model.

    Args:
        options: as given.
        inputs: of the fit, by the setting that keeps each, such as `text` and `text_model`; None where one is
            not given.

    Raises:
        ConfigError: the settings name another one.
        WeightsError: the model is named and not there.
    """
    settings = by_key(options.get("set", ()))
    for key, value in inputs.items():
        if value is not None and settings.setdefault(key, value) != value:
            raise ConfigError(f"{key} is set to {settings[key]} and to {value}", "give it once")
    elsewhere = options.get("config") or options.get("resume") or "preset" in settings
    preset = options.get("preset")
    if not (preset or elsewhere):
        from mitex.features.text_model import model_folder  # imports torch, which settings alone do not need

        preset = CLIP if model_folder(settings.get("text_model")) else EMBEDDED
    return {**options, "set": settings, "preset": preset}


def check_text(text: str | None, preset: str, presets: Collection[str] = PRESETS) -> None:
    """Refuses an empty text, and settings that are not for words.

    Raises:
        ConfigError: it is one of these.
    """
    if preset not in presets:
        raise ConfigError(
            f"the preset {preset} is for exemplars, not for words", f"use one of {', '.join(presets)}"
        )
    if not (text or "").strip():
        raise ConfigError("the text is empty", "say what the texture is made of")
