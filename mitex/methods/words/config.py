"""Settings that fits from words share."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from mitex.errors import ConfigError
from mitex.features.text_image import PROMPT, object_prompt
from mitex.training.settings import key


@dataclass(frozen=True)
class PromptConfig:
    """What is said, and which parts of a view are compared with it."""

    text: str | None = key(None, "what the mesh is made of, in words")
    text_object: str | None = key(None, "what the mesh is; by default its name")
    text_prompt: str = key(PROMPT, "sentence that the vision-language model reads")
    text_model: str | None = key(None, "CLIP folder, or words for the small embedded model")
    text_crops: int = key(4, "close-ups that are cut out of a view", 1, 64)
    text_crop_area: float = key(0.1, "area of a close-up, as a share of the view", 1e-3, 1)
    text_tilt: float = key(
        0.5, "perspective tilt of what the model sees: how far corners move [half sides]", 0, 2
    )
    text_whole_weight: float = key(1.0, "weight of whole views' distance from the text", 0)
    text_close_weight: float = key(1.0, "weight of the close-ups' distance from the text", 0)


@dataclass(frozen=True)
class WordsConfig(PromptConfig):
    """The same for one mesh."""

    text_background: float = key(1.0, "around the mesh [sRGB]; the papers: white", 0, 1)

    def prompt(self, name: str) -> str:
        """What the vision-language model reads of the mesh of that name."""
        return object_prompt(self.text or "", self.text_object or name, self.text_prompt)


def check_words(config: Any, *weights: str) -> None:
    """Refuses a prompt without the text, and a loss of nothing.

    Args:
        config: with `text_prompt`.
        weights: its keys of the parts of the loss.

    Raises:
        ConfigError: it is one of these.
    """
    if "{text}" not in config.text_prompt:
        raise ConfigError(f"text_prompt = '{config.text_prompt}' leaves out the text", "put {text} in it")
    if not any(getattr(config, name) for name in weights):
        raise ConfigError(f"{', '.join(weights)} are all 0", "let one count")
