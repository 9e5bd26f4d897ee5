"""The command-line options that fits from words share."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, ClassVar, Literal

from tyro.conf import arg

from mitex.methods.checks import check_source
from mitex.methods.option_types import ExemplarName, PlainText
from mitex.methods.options import TrainingOptions
from mitex.training.settings import RunSettings

LONGEST = 60  # name of a run folder from words [characters]


@dataclass(kw_only=True)
class WordsOptions(TrainingOptions):
    """Options of the methods that learn from words; the text is each method's own."""

    clip: Annotated[Literal["words"] | str | None, arg(metavar="DIR|NAME", help_behavior_hint="")] = None
    """With --text: folder of a CLIP model, name of one in Hugging Face's cache, or `words` for the small
    embedded model. By default $MITEX_CLIP, else the cache, else the embedded one."""

    def words_folder(self, *words: str) -> Path:
        """The run folder: --out, else one in runs/ whose name is made of a text and further words."""
        letters = re.findall(r"[a-z0-9]+", words[0].lower())
        return self.folder("-".join(["-".join(letters)[:LONGEST] or "text", *words[1:]]))


@dataclass(kw_only=True)
class ExemplarOrWordsOptions(WordsOptions):
    """Options of the methods that learn from an exemplar, or from words, whose help is their own."""

    source: ClassVar[str | None] = "exemplar"

    exemplar: Annotated[ExemplarName | None, arg(metavar="IMAGE|DIR|NAME", help_behavior_hint="")] = None
    """PNG or JPEG, a folder with any of albedo, height, normal, roughness, ambient_occlusion, or a name."""

    text: Annotated[PlainText | None, arg(metavar="WORDS", help_behavior_hint="")] = None
    """What the mesh is made of."""

    def check_source(self) -> None:
        """Refuses sources that are missing, or do not go together."""
        check_source(self.exemplar, self.text, self.clip)

    def fit(self, options: RunSettings) -> Path:
        """Fits from what was given; the run folder."""
        return self.fit_exemplar(options) if self.text is None else self.fit_text(self.text, options)

    def fit_exemplar(self, options: RunSettings) -> Path:
        """Fits from the exemplar alone; the run folder."""
        raise NotImplementedError

    def fit_text(self, text: str, options: RunSettings) -> Path:
        """Fits from words; the run folder."""
        raise NotImplementedError
