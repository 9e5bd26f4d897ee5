"""How often the embedded vision-language model finds the text of a picture, and the picture of a text."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import torch
import torch.nn.functional as F
from word_captions import VALUES, phrase
from word_patterns import KINDS
from word_pictures import COLOURFUL, COLOURS, Subject, draw_subject, render

from mitex.features.words.network import RESOLUTION, WordsNetwork, numbered

CHOICES = 100  # texts that a picture is compared with
REPEATS = 5


def held_out(count: int, seed: int, fits: Callable[[Subject], bool] = lambda _: True) -> list[Subject]:
    """Different subjects of combinations that were not trained on."""
    rng, drawn = np.random.default_rng(seed), []
    while len(drawn) < count:
        subject = draw_subject(rng)
        if subject.held_out and subject not in drawn and fits(subject):
            drawn.append(subject)
    return drawn


def full(subject: Subject, rng: np.random.Generator) -> list[str]:
    """A caption that says all there is."""
    said = {key: getattr(subject, key) or None for key in VALUES}
    said |= {"scale": subject.scale if subject.scale != "medium" else None}
    return phrase(said, KINDS[subject.kind].equal, rng)


def likeness(
    network: WordsNetwork, subjects: list[Subject], texts: list[list[str]], seed: int
) -> torch.Tensor:
    """(pictures, texts) cosines."""
    images = torch.from_numpy(render(subjects, RESOLUTION, seed)).permute(0, 3, 1, 2) / 255
    pictures = torch.cat([network.image(part) for part in images.split(64)])
    return F.normalize(pictures, dim=1) @ F.normalize(network.text(numbered(texts)), dim=1).T


def among_hundred(network: WordsNetwork, seed: int) -> tuple[float, float]:
    """Shares of held-out pictures that find their text among 100, and of texts that find their picture."""
    subjects = held_out(CHOICES, seed)
    table = likeness(network, subjects, [full(s, np.random.default_rng(seed)) for s in subjects], seed)
    right = torch.arange(CHOICES)
    return (table.argmax(1) == right).float().mean().item(), (table.argmax(0) == right).float().mean().item()


def told_apart(network: WordsNetwork, key: str, values: list[str | bool], seed: int) -> float:
    """The share of held-out pictures for which one attribute is told among all its values."""

    def fits(subject: Subject) -> bool:
        alike = subject.figure == subject.ground or COLOURFUL in (subject.figure, subject.ground)
        return getattr(subject, key) in values and not alike and subject.kind != "plain"

    subjects = held_out(CHOICES, seed, fits)
    texts = [
        full(replace(s, **{key: value}), np.random.default_rng(seed)) for s in subjects for value in values
    ]
    table = likeness(network, subjects, texts, seed).view(len(subjects), len(subjects), len(values))
    best = table[torch.arange(len(subjects)), torch.arange(len(subjects))].argmax(1).tolist()
    return float(np.mean([values[b] == getattr(s, key) for b, s in zip(best, subjects, strict=True)]))


def order(network: WordsNetwork, seed: int) -> float:
    """The share of held-out pictures of "red dots on white" that are not taken for "white dots on red"."""
    subjects = held_out(
        CHOICES,
        seed,
        lambda s: not KINDS[s.kind].equal and s.figure != s.ground and COLOURFUL not in (s.figure, s.ground),
    )
    swapped = [replace(s, figure=s.ground, ground=s.figure) for s in subjects]
    texts = [full(s, np.random.default_rng(seed)) for s in subjects + swapped]
    table = likeness(network, subjects, texts, seed)
    return (table.diagonal() > table.diagonal(CHOICES)).float().mean().item()


def retrieval(network: WordsNetwork) -> dict[str, float]:
    """All shares by name, means over some sets of 100 held-out pictures."""
    colours: list[str | bool] = [*COLOURS]
    lists: dict[str, tuple[str, list[str | bool]]] = {
        f"pattern among {len(KINDS) - 1}": ("kind", [k for k in KINDS if k != "plain"]),
        f"figure among {len(COLOURS)} colours": ("figure", colours),
        f"ground among {len(COLOURS)} colours": ("ground", colours),
        "scale among 3": ("scale", ["small", "medium", "large"]),
        "material among 5": ("material", ["matte", "shiny", "metallic", "rough", "relief"]),
        "direction among 3": ("direction", ["vertical", "horizontal", "diagonal"]),
    }
    seeds = range(100, 100 + REPEATS)
    both = np.mean([among_hundred(network, seed) for seed in seeds], 0)
    shares = {"text among 100": float(both[0]), "picture among 100": float(both[1])}
    for name, (key, values) in lists.items():
        shares[name] = float(np.mean([told_apart(network, key, values, seed) for seed in seeds[:2]]))
    return shares | {"order of colours among 2": float(np.mean([order(network, seed) for seed in seeds]))}
