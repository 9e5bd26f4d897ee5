"""What losses and searches ask of a vision-language model: two encoders into one space."""

from __future__ import annotations

from collections.abc import Sequence
from typing import TYPE_CHECKING, Protocol

if TYPE_CHECKING:  # settings read the prompt, without torch
    import torch

PROMPT = "an image of {object} made of {text}"  # MeshNCA, section 4.2


def object_prompt(text: str, thing: str, template: str = PROMPT) -> str:
    """What a model reads of a texture on an object.

    Args:
        text: what the texture is made of.
        thing: the object, without an article.
        template: with `{object}` and `{text}` in it.
    """
    article = "an" if thing[:1].lower() in list("aeiou") else "a"
    return template.replace("{object}", f"{article} {thing}").replace("{text}", text)


class TextImageModel(Protocol):
    """A frozen pair of encoders, trained so that a text and its picture point in the same direction."""

    @property
    def name(self) -> str:
        """What it is, as people call it."""
        ...

    @property
    def resolution(self) -> int:
        """Width and height of the pictures that it sees [px]."""
        ...

    def encode_images(self, images: torch.Tensor) -> torch.Tensor:
        """Encodes pictures, differentiable in them.

        Args:
            images: (K, R, R, 3) sRGB in [0, 1], R the `resolution`.

        Returns:
            (K, D) embeddings, not normalised.

        Raises:
            ImageError: pictures of another shape.
        """
        ...

    def encode_texts(self, texts: Sequence[str]) -> torch.Tensor:
        """Encodes texts.

        Returns:
            (N, D) embeddings, not normalised.

        Raises:
            ConfigError: a text that is empty, too long, or says what the model does not know.
        """
        ...
