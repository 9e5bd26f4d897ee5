"""Words and a mesh: how well pictures of textures on the mesh fit the words."""

from __future__ import annotations

from functools import cache, cached_property
from pathlib import Path

import numpy as np
import torch

from mitex.asset import Asset, clay
from mitex.cache import content_key
from mitex.comparison.inputs import lit, mesh_of
from mitex.evaluation.text import text_scores
from mitex.features.text_image import TextImageModel, object_prompt
from mitex.features.text_model import text_image_model
from mitex.render.sides import sides


@cache
def model() -> TextImageModel:
    """The vision-language model that judges: a CLIP folder if there is one, else that of Mitex."""
    return text_image_model()


class TextPair:
    """Words and a mesh.

    Args:
        exemplar: the words.
        mesh: path or name.
    """

    image = None

    def __init__(self, exemplar: str, mesh: str) -> None:
        self.words, self.mesh = exemplar, mesh_of(mesh)

    @property
    def key(self) -> str:
        """A hash of both, and of the model."""
        return content_key(self.words, model().name, self.mesh.vertices, self.mesh.faces)

    def numbers(self, asset: Asset, run: Path) -> dict[str, float]:
        """The scores of MeshNCA, section G.1."""
        prompt = object_prompt(self.words, self.mesh.name)
        scores = text_scores(model(), _seen(asset), self._bare, prompt, self.mesh.name)
        return {"mes": scores.score, "mes_dir": scores.direction}

    def floor(self) -> dict[str, float]:
        """Words have no texture of their own."""
        return {}

    def picture(self, asset: Asset) -> np.ndarray:
        """As of `mitex.comparison.inputs.lit`."""
        return lit(asset, self.mesh)

    @cached_property
    def _bare(self) -> torch.Tensor:
        return _seen(clay(self.mesh))


def _seen(asset: Asset) -> torch.Tensor:
    """(24, R, R, 3) sRGB in [0, 1]: an asset from all sides, R the model's resolution."""
    return torch.from_numpy(sides(asset, model().resolution))
