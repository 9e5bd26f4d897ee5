"""The trained vision-language model that ships with the package."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cache

import torch

from mitex.errors import ImageError
from mitex.features import weights
from mitex.features.words.network import RESOLUTION, WordsNetwork, numbered
from mitex.features.words.vocabulary import concepts


class WordsModel:
    """A small `TextImageModel`, trained by `tools/train_words.py` on patterns with captions.

    It knows the colours, patterns and materials of `vocabulary` and nothing else: no objects, no styles. It
    is not CLIP. Frozen: gradients reach the pictures only.

    Args:
        network: with its weights.
    """

    name = "the embedded vision-language model"
    resolution = RESOLUTION

    def __init__(self, network: WordsNetwork) -> None:
        self.network = network.requires_grad_(False).eval()

    def encode_images(self, images: torch.Tensor) -> torch.Tensor:
        """Encodes pictures, differentiable in them, in their precision.

        Args:
            images: (K, 64, 64, 3) sRGB in [0, 1].

        Returns:
            (K, 128) embeddings, not normalised.

        Raises:
            ImageError: pictures of another shape.
        """
        if images.ndim != 4 or images.shape[1:] != (RESOLUTION, RESOLUTION, 3):
            raise ImageError(f"pictures of shape {tuple(images.shape)}", "give (K, 64, 64, 3), sRGB")
        return self.network.image(images.permute(0, 3, 1, 2))

    def encode_texts(self, texts: Sequence[str]) -> torch.Tensor:
        """Encodes texts of known words.

        Returns:
            (N, 128) embeddings, not normalised.

        Raises:
            ConfigError: a text that is empty, too long, or has an unknown word.
        """
        numbers = numbered([concepts(text) for text in texts])
        return self.network.text(numbers.to(next(self.network.parameters()).device))


@cache
def words_model(device: torch.device | str = "cpu") -> WordsModel:
    """The model that ships with the package.

    Args:
        device: where its weights live.

    Raises:
        WeightsError: the file is missing or not the expected one.
    """
    from safetensors.torch import load_file

    path = weights.shipped(weights.WORDS_FILE)
    weights.verify(path, weights.WORDS_SHA256)
    with torch.random.fork_rng(devices=()):  # first weights are drawn, and replaced
        network = WordsNetwork()
    network.load_state_dict(load_file(path))
    return WordsModel(network.to(device))
