"""How well pictures fit words."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
import torch
import torch.nn.functional as F

from mitex.features.words.model import WordsModel, words_model
from mitex.images import resize

PIECES = ((0.0, 0.0, 1.0), (0.15, 0.0, 0.7), (0.25, 0.1, 0.5))
"""Squares that are looked at: left, top, width, as parts of the picture's. Thumbnails show balls on feet."""


@torch.no_grad()
def likeness(text: str, pictures: Sequence[np.ndarray], model: WordsModel | None = None) -> list[float]:
    """How well each picture fits a text, looked at as a whole and from nearby.

    Args:
        text: of words that the model knows.
        pictures: (N, N, 3) each, sRGB in [0, 1].
        model: by default the one that ships with the package.

    Returns:
        Mean cosines of a picture's pieces with the text, in [-1, 1].

    Raises:
        ConfigError: the text is empty, too long, or has an unknown word.
        WeightsError: the model's file is missing or not the expected one.
    """
    model = model or words_model()
    direction = F.normalize(model.encode_texts([text]), dim=1)
    cosines = []
    for picture in pictures:
        embeddings = model.encode_images(torch.from_numpy(_pieces(picture, model.resolution)))
        cosines.append((F.normalize(embeddings, dim=1) @ direction.T).mean().item())
    return cosines


def _pieces(picture: np.ndarray, side: int) -> np.ndarray:
    """(3, side, side, 3) float32."""
    width = picture.shape[0]
    pieces = []
    for left, top, size in PIECES:
        y, x, part = (round(share * width) for share in (top, left, size))
        pieces.append(resize(picture[y : y + part, x : x + part], side, side))
    return np.stack(pieces).astype(np.float32)
