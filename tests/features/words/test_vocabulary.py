"""What the embedded vision-language model reads in a text, and what it refuses."""

import pytest

from mitex.errors import ConfigError
from mitex.features.words import concepts, vocabulary
from mitex.features.words.network import numbered
from mitex.features.words.vocabulary import CONCEPTS, LONGEST


@pytest.mark.parametrize(
    ("text", "read"),
    [
        ("red dots on white", "red dots on white"),
        ("An image of a sphere made of Red polka-dots, on a white background.", "object red dots on white"),
        ("a white texture with crimson spots", "white with red dots"),
        ("tiny grey STRIPES", "small grey stripes"),
        ("brick", "bricks"),
        ("a checkered pattern in black and white", "checks in black and white"),
        ("navy crosses", "dark blue crosses"),
        ("stained glass", "colourful mosaic on black"),
        ("shiny pebble", "shiny pebbles"),
    ],
)
def test_reading(text, read):
    assert concepts(text) == read.split()


def test_every_word_is_read_as_concepts():
    for word in vocabulary():
        assert set(concepts(word)) <= set(CONCEPTS)
    assert len(set(CONCEPTS)) == len(CONCEPTS)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("red dotz on white", "'dotz'; did you mean dots?"),
        ("a brown xylophone", "'xylophone'; use colours"),
        ("", "says nothing"),
        ("an image of a texture", "says nothing"),
        ("?!", "says nothing"),
        ("red " * (LONGEST + 1), "17 words"),
    ],
)
def test_refused(text, message):
    with pytest.raises(ConfigError, match=message):
        concepts(text)


def test_numbers_are_places_in_the_list_filled_up_with_zero():
    numbers = numbered([["red", "dots"], ["white"]])
    assert numbers.tolist() == [
        [CONCEPTS.index("red") + 1, CONCEPTS.index("dots") + 1],
        [CONCEPTS.index("white") + 1, 0],
    ]
