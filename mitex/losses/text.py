"""How far pictures are from what a text says, as a direction among the embeddings of a model of both."""

from __future__ import annotations

import torch
import torch.nn.functional as F

SHORT = 0.02  # length of a step between unit embeddings below which it has no direction to speak of


def mean_direction(embeddings: torch.Tensor) -> torch.Tensor:
    """The mean (D,) of embeddings (K, D), each divided by its length first (Gal et al. 2022).

    MeshNCA's equation 7 takes the mean of the embeddings as they are, where long ones count more.
    """
    return F.normalize(embeddings, dim=1).mean(0)


def directional_distance(
    pictures: torch.Tensor, negatives: torch.Tensor, text: torch.Tensor, negative_text: torch.Tensor
) -> torch.Tensor:
    """1 - cos(R - R_neg, T - T_neg), from 0 to 2 (MeshNCA, equations 8 and 9).

    R are `mean_direction`s of embeddings, T embeddings divided by their length. Where R = R_neg, as of the
    grey seed, the cosine is not defined and its gradient has no bound. With a guard of `SHORT` in the length
    of R - R_neg, the distance is 1 there, and its gradient 1 / `SHORT` towards the text.

    Args:
        pictures: (D,), of what shall look as the text says.
        negatives: (D,), of the same without any texture, seen in the same way.
        text, negative_text: (D,) embeddings of what is wanted, and of what the negatives show.
    """
    step = pictures - negatives
    aim = F.normalize(F.normalize(text, dim=0) - F.normalize(negative_text, dim=0), dim=0)
    return 1 - step @ aim / (step.square().sum() + SHORT**2).sqrt()


def text_distance(pictures: torch.Tensor, text: torch.Tensor) -> torch.Tensor:
    """1 - R T / norm(T), from 0 to 2: one minus the mean cosine of the pictures with the text.

    MeshNCA compares its equation 9 with the cosine of the mean (figure 17), to which it does not matter how
    much the pictures differ.

    Args:
        pictures: (D,), a `mean_direction`.
        text: (D,) embedding of what is wanted.
    """
    return 1 - pictures @ F.normalize(text, dim=0)


def embedding_distance(pictures: torch.Tensor, text: torch.Tensor) -> torch.Tensor:
    """1 - cosine of the pictures' mean embedding with the text, from 0 to 2 (Text2Mesh, section 3.2).

    Embeddings are not normalised before their mean: longer ones count more.

    Args:
        pictures: (K, D) embeddings.
        text: (D,) embedding of what is wanted.
    """
    return 1 - F.cosine_similarity(pictures.mean(0), text, dim=0)
