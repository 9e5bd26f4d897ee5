"""The vision-language model that a fit from words looks through."""

from __future__ import annotations

import os
from pathlib import Path

import torch

from mitex.features.clip import Clip, cached_folder, named_folder
from mitex.features.text_image import TextImageModel
from mitex.features.words import words_model

EMBEDDED = "words"


def text_image_model(
    clip: str | os.PathLike[str] | None = None, device: torch.device | str = "cpu"
) -> TextImageModel:
    """The first of these that there is: the named CLIP folder, that of `MITEX_CLIP`, a public CLIP model in
    Hugging Face's cache, the small model that ships with Mitex.

    Args:
        clip: as of `mitex.features.clip.named_folder`; "words" for the model that ships with Mitex.
        device: where its weights live.

    Raises:
        WeightsError: the named folder is not there, incomplete or damaged.
        MissingPackage: a CLIP model needs the package tokenizers.
    """
    folder = model_folder(clip)
    return Clip(folder, device=device) if folder else words_model(device)


def model_folder(clip: str | os.PathLike[str] | None = None) -> Path | None:
    """Where the CLIP model is that `text_image_model` would take; None if that is the one that ships."""
    return None if clip == EMBEDDED else named_folder(clip) or cached_folder()
