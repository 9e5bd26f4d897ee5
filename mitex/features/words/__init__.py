"""A small model of texts and pictures with a limited vocabulary, for patterns, colours and materials."""

from mitex.features.words.likeness import likeness
from mitex.features.words.model import WordsModel, words_model
from mitex.features.words.vocabulary import concepts, vocabulary

__all__ = ["WordsModel", "concepts", "likeness", "vocabulary", "words_model"]
