"""Texts as tokens of a CLIP model."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING

import torch

from mitex.errors import ConfigError, WeightsError
from mitex.features.clip.shape import ClipShape
from mitex.optional import optional

if TYPE_CHECKING:
    import tokenizers

START, END = "<|startoftext|>", "<|endoftext|>"
# Contractions, words, single digits, and runs of other characters (Radford et al. 2021).
PIECES = r"'s|'t|'re|'ve|'m|'ll|'d|[\p{L}]+|[\p{N}]|[^\s\p{L}\p{N}]+"


class Tokenizer:
    """Byte-pair encoding as the folder of a model has it, in tokenizer.json or in vocab.json and merges.txt.

    Args:
        folder: of the model.
        shape: of the model.

    Raises:
        WeightsError: the files are damaged, or of another model.
        MissingPackage: the library that reads them is not installed.
    """

    def __init__(self, folder: Path, shape: ClipShape) -> None:
        self._shape = shape
        tokenizers = optional("tokenizers", "text")
        whole = folder / "tokenizer.json"
        try:
            if whole.is_file():
                self._encoder = tokenizers.Tokenizer.from_file(str(whole))
            else:
                self._encoder = _assembled(folder)
            self._encoder.no_truncation()
            self._encoder.no_padding()
            tokens = self._encoder.encode("a").ids
        except Exception as e:  # the library raises Exception itself
            problem = f"the tokenizer in {folder} cannot be read ({e})"
            raise WeightsError(problem, "download its files again") from e
        size = self._encoder.get_vocab_size()
        if size > shape.vocabulary or len(tokens) < 2 or tokens[-1] != shape.end:
            raise WeightsError(
                f"the tokenizer in {folder} is not that of its model", "download the whole folder again"
            )

    def __call__(self, texts: Sequence[str]) -> tuple[torch.Tensor, torch.Tensor]:
        """Tokens (N, L) int64, and where each text ends (N,).

        What comes after the end matters to no token before it, so that any padding is as good.

        Raises:
            ConfigError: a text that is empty or too long.
        """
        rows = [self._tokens(text) for text in texts]
        longest = max(map(len, rows), default=0)
        padded = [row + [self._shape.end] * (longest - len(row)) for row in rows]
        return torch.tensor(padded), torch.tensor([len(row) - 1 for row in rows])

    def _tokens(self, text: str) -> list[int]:
        if not text.strip():
            raise ConfigError("the text is empty", "say what the texture shall look like")
        tokens, most = self._encoder.encode(text).ids, self._shape.length
        if len(tokens) > most:
            start = text[:30].strip()
            raise ConfigError(
                f"the text '{start}...' has {len(tokens) - 2} tokens", f"give {most - 2} at most: shorten it"
            )
        return tokens


def _assembled(folder: Path) -> tokenizers.Tokenizer:
    """From the list of tokens and that of the pairs that are merged, in their order."""
    from tokenizers import Regex, Tokenizer, models, normalizers, pre_tokenizers, processors

    vocabulary = json.loads((folder / "vocab.json").read_text("utf-8"))
    lines = (folder / "merges.txt").read_text("utf-8").splitlines()
    pairs = [line.split() for line in lines if line.strip() and not line.startswith("#version")]
    merges = [(first, second) for first, second in pairs]
    encoder = Tokenizer(models.BPE(vocab=vocabulary, merges=merges, end_of_word_suffix="</w>", unk_token=END))
    encoder.normalizer = normalizers.Sequence(
        [normalizers.NFC(), normalizers.Replace(Regex(r"\s+"), " "), normalizers.Lowercase()]
    )
    encoder.pre_tokenizer = pre_tokenizers.Sequence(
        [
            pre_tokenizers.Split(Regex(PIECES), behavior="removed", invert=True),
            pre_tokenizers.ByteLevel(add_prefix_space=False),
        ]
    )
    encoder.post_processor = processors.TemplateProcessing(
        single=f"{START} $A {END}", special_tokens=[(name, vocabulary[name]) for name in (START, END)]
    )
    return encoder
