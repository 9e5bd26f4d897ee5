"""How well pictures of a texture fit the words that it was made from (MeshNCA, section G.1)."""

from __future__ import annotations

from typing import NamedTuple

import torch
import torch.nn.functional as F

from mitex.features.text_image import TextImageModel
from mitex.losses import mean_direction


class TextScores(NamedTuple):
    """Cosines times 100, from -100 to 100; more is better.

    Attributes:
        score: of the pictures' mean direction and the text (MES). It rises with patterns that only the model
            likes.
        direction: of the steps from the bare object to the textured one, among pictures and among texts
            (MES-dir), which agrees with people.
    """

    score: float
    direction: float


@torch.no_grad()
def text_scores(
    model: TextImageModel, pictures: torch.Tensor, bare: torch.Tensor, text: str, thing: str
) -> TextScores:
    """Scores of a textured object, by another model than the one that it was trained with.

    Args:
        model: the vision-language model.
        pictures: (K, R, R, 3) sRGB in [0, 1], R the model's resolution: the object from all sides, as 24 in
            the paper.
        bare: (K, R, R, 3), the same views of the object in grey.
        text: such as "an image of a vase made of bark".
        thing: the object's name.

    Raises:
        ConfigError: pictures or texts that the model cannot read.
    """
    textured, plain = (mean_direction(model.encode_images(views)) for views in (pictures, bare))
    words, name = F.normalize(model.encode_texts([text, thing]), dim=1)
    score = F.cosine_similarity(textured, words, dim=0)
    direction = F.cosine_similarity(textured - plain, words - name, dim=0)
    return TextScores(100 * score.item(), 100 * direction.item())
