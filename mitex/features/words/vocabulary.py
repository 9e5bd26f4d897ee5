"""The words of the embedded vision-language model, and how a text becomes a series of its concepts."""

from __future__ import annotations

import re
from collections.abc import Iterable

from mitex.errors import ConfigError
from mitex.suggestions import suggestion

LONGEST = 16  # concepts of a text


def _listed(words: str) -> tuple[str, ...]:
    return tuple(words.split())


COLOURS = _listed(
    "red orange yellow green cyan blue purple pink brown beige black grey white dark light colourful"
)
PATTERNS = _listed(
    "plain dots rings stars flowers hearts triangles crosses leaves stripes waves zigzag checks diamonds "
    "bricks grid plaid weave knit scales hexagons pebbles mosaic cracks blotches clouds marble speckles wood "
    "fur maze"
)
OTHERS = _listed(
    "small medium large matte shiny metallic rough relief vertical horizontal diagonal on with and in object"
)
CONCEPTS = (*COLOURS, *PATTERNS, *OTHERS)
"""What the text encoder has embeddings of, in their order in the weights; position 0 is no word."""

_SYNONYMS = {
    "red": "scarlet crimson reddish",
    "orange": "tangerine",
    "yellow": "golden lemon yellowish",
    "green": "greenish grassy",
    "cyan": "turquoise teal aqua",
    "blue": "bluish azure",
    "purple": "violet lilac mauve magenta",
    "pink": "rose pinkish",
    "brown": "brownish chocolate",
    "beige": "cream tan ivory sand",
    "black": "ebony jet",
    "grey": "gray greyish grayish",
    "white": "snow",
    "dark": "deep darker",
    "light": "pale pastel lighter",
    "colourful": "colorful multicoloured multicolored rainbow motley",
    "plain": "solid uniform blank smooth unpatterned",
    "dots": "spots dotted spotted polka circles discs disks points",
    "rings": "loops hoops",
    "stars": "starry",
    "flowers": "floral blossoms daisies flowery",
    "triangles": "triangular",
    "crosses": "pluses plus",
    "leaves": "leaf foliage leafy",
    "stripes": "striped lines bands stripy",
    "waves": "wavy ripples undulating",
    "zigzag": "zigzags chevron chevrons herringbone",
    "checks": "checkerboard chequerboard checkered chequered chessboard checked squares checker chess",
    "diamonds": "rhombs rhombuses lozenges harlequin argyle",
    "bricks": "brickwork brick",
    "grid": "lattice net wire",
    "plaid": "tartan gingham",
    "weave": "woven wicker basket rattan basketweave",
    "knit": "knitted crochet crocheted wool woollen woolen knitting",
    "scales": "scaly fishscales",
    "hexagons": "hexagonal honeycomb hexes",
    "pebbles": "stones cobblestone cobblestones cobbles pebble stone rocks",
    "mosaic": "tiles cells voronoi shards",
    "cracks": "cracked fissures crackle",
    "blotches": "patches camouflage blobs blotchy patchy",
    "clouds": "cloudy cloud noise smoke foggy",
    "marble": "marbled veins veined",
    "speckles": "speckled grains terrazzo freckles grainy sprinkles",
    "wood": "wooden timber planks",
    "fur": "furry hair hairy strands",
    "maze": "labyrinth truchet",
    "small": "tiny little fine thin dense",
    "medium": "normal",
    "large": "big huge coarse wide bold thick giant",
    "matte": "mat dull",
    "shiny": "glossy polished gleaming glazed lacquered",
    "metallic": "metal steel chrome",
    "rough": "coarsened gritty uneven",
    "relief": "bumpy embossed carved engraved raised",
    "vertical": "upright",
    "horizontal": "level",
    "diagonal": "slanted oblique",
    "on": "over onto upon",
    "with": "having",
    "object": "sphere ball bunny chair vase mug cube cylinder torus teapot egg alien shape octopus knot mesh",
}
_PHRASES = {
    "navy": "dark blue",
    "maroon": "dark red",
    "bark": "rough dark brown wood",
    "gold": "metallic yellow",
    "silver": "metallic light grey",
    "copper": "metallic orange",
    "rust": "rough brown and orange clouds",
    "rusty": "rough brown and orange clouds",
    "moss": "rough green and dark green speckles",
    "grass": "green and dark green fur",
    "lava": "orange cracks on black",
    "granite": "small black speckles on light grey",
    "sandstone": "rough beige",
    "leather": "relief small brown pebbles",
    "zebra": "black and white waves",
    "leopard": "dark brown rings on beige",
    "giraffe": "brown mosaic on beige",
    "cow": "black blotches on white",
    "ladybird": "black dots on red",
    "ladybug": "black dots on red",
    "snake": "green and dark green scales",
    "dragon": "green and dark green scales",
    "fish": "scales",
    "sky": "white clouds on light blue",
    "water": "blue and light blue waves",
    "sea": "blue and light blue waves",
    "stained glass": "colourful mosaic on black",
    "jelly beans": "shiny colourful pebbles",
    "polka dots": "dots",
    "paving stones": "pebbles",
    "fish scales": "scales",
    "brick wall": "bricks",
    "chess board": "checks",
}
_STOP = _listed(
    "a an the of made from image picture photo rendering render 3d texture textured pattern patterned "
    "surface material background ground cover covered coloured colored colour color style skin bright "
    "fabric cloth some very is its it to by that has"
)


def _table() -> dict[str, tuple[str, ...]]:
    table = {concept: (concept,) for concept in CONCEPTS}
    for concept, words in _SYNONYMS.items():
        table |= {word: (concept,) for word in words.split()}
    return table | {phrase: tuple(said.split()) for phrase, said in _PHRASES.items()}


_TABLE = _table()


def vocabulary() -> list[str]:
    """Every word and phrase that the model knows, in order of the alphabet."""
    return sorted(_TABLE)


def concepts(text: str) -> list[str]:
    """What the model reads in a text: synonyms by one name, words that say nothing left out.

    "A sphere made of polka dots" is object, dots; "lava" is orange, cracks, on, black.

    Returns:
        1 to 16 of `CONCEPTS`.

    Raises:
        ConfigError: there is an unknown word, nothing that says anything, or too much.
    """
    words = re.findall(r"[^\W_]+", text.lower())
    read = [concept for name in _joined(words) for concept in _known(name)]
    if not read:
        raise ConfigError(f"the text {text!r} says nothing", "name colours and a pattern: red dots on white")
    if len(read) > LONGEST:
        raise ConfigError(f"a text of {len(read)} words", f"say it in {LONGEST} at most")
    return read


def _joined(words: list[str]) -> Iterable[str]:
    """The words without those that say nothing; two that are known together as one."""
    i = 0
    while i < len(words):
        pair = " ".join(words[i : i + 2])
        if pair in _PHRASES:
            yield pair
        elif words[i] not in _STOP:
            yield words[i]
        i += 2 if pair in _PHRASES else 1


def _known(word: str) -> tuple[str, ...]:
    """The concepts of a word, singular or plural."""
    for form in (word, word + "s", word.removesuffix("s"), word.removesuffix("es"), word + "es"):
        if form in _TABLE:
            return _TABLE[form]
    near = suggestion(word, vocabulary(), "use colours, patterns and materials, as in: red dots on white")
    raise ConfigError(f"the embedded text model does not know the word {word!r}", near)
