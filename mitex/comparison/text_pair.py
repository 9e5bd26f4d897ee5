"""Words and a mesh: how well pictures of textures on the mesh fit the words."""

from __future__ import annotations

from functools import cached_property
from pathlib import Path

import numpy as np
import torch

from mitex.asset import Asset, clay
from mitex.cache import content_key
from mitex.comparison.inputs import lit_picture, mesh_of, read_once
from mitex.comparison.results import LIT
from mitex.evaluation.text import text_scores
from mitex.features.text_image import TextImageModel, object_prompt
from mitex.features.text_model import text_image_model
from mitex.render.sides import sides


@read_once
def judge_of(clip: str) -> TextImageModel:
    """The vision-language model that judges, as of `text_image_model`; "" names none.

    Raises:
        WeightsError, ConfigError: There is no such model, or it cannot be read.
    """
    return text_image_model(clip)


class TextPair:
    """Words and a mesh.

    Args:
        exemplar: the words.
        mesh: path or name.
        judge: CLIP folder; None for the one that Mitex finds, or else its own small model.
    """

    image = None

    def __init__(self, exemplar: str, mesh: str, judge: str | None = None) -> None:
        self.words, self.mesh, self._model = exemplar, mesh_of(mesh), judge_of(judge or "")

    @property
    def judge(self) -> str:
        """The model's name."""
        return self._model.name

    @property
    def key(self) -> str:
        """A hash of both, and of the judge's name."""
        return content_key(self.words, self.judge, self.mesh.vertices, self.mesh.faces)

    def numbers(self, asset: Asset, run: Path) -> dict[str, float]:
        """The scores of MeshNCA, section G.1."""
        prompt = object_prompt(self.words, self.mesh.name)
        scores = text_scores(self._model, self._seen(asset), self._bare, prompt, self.mesh.name)
        return {"mes": scores.score, "mes_dir": scores.direction}

    def floor(self) -> dict[str, float]:
        """Words have no texture of their own."""
        return {}

    def pictures(self, asset: Asset, run: Path) -> dict[str, np.ndarray]:
        """As of `mitex.comparison.inputs.lit_picture`."""
        return {LIT: lit_picture(asset, self.mesh)}

    @cached_property
    def _bare(self) -> torch.Tensor:
        return self._seen(clay(self.mesh))

    def _seen(self, asset: Asset) -> torch.Tensor:
        """(24, R, R, 3) sRGB in [0, 1]: an asset from all sides, R the model's resolution."""
        return torch.from_numpy(sides(asset, self._model.resolution))
