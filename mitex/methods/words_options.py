"""The command-line options that fits from words share."""

from __future__ import annotations

import re
from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

from tyro.conf import arg

from mitex.methods.options import TrainingOptions

LONGEST = 60  # name of a run folder from words [characters]


@dataclass(kw_only=True)
class WordsOptions(TrainingOptions):
    """Options of the methods that learn from words; the text is each method's own."""

    clip: Annotated[str | None, arg(metavar="DIR|NAME", help_behavior_hint="")] = None
    """With --text: folder of a CLIP model, name of one in Hugging Face's cache, or `words` for the small
    embedded model. By default $MITEX_CLIP, else the cache, else the embedded one."""

    def words_folder(self, *words: str) -> Path:
        """The run folder: --out, else one in runs/ whose name is made of a text and further words."""
        letters = re.findall(r"[a-z0-9]+", words[0].lower())
        return self.folder("-".join(["-".join(letters)[:LONGEST] or "text", *words[1:]]))
