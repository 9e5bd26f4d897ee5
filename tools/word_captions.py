"""What one may say about a picture, in the concepts of the embedded vision-language model."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np
import torch
from word_patterns import KINDS
from word_pictures import COLOURFUL, COLOURS, DIRECTIONS, MATERIALS, SCALES, Subject

VALUES = {
    "kind": list(KINDS),
    "figure": [*COLOURS, COLOURFUL],
    "ground": [*COLOURS, COLOURFUL],
    "scale": list(SCALES),
    "material": list(MATERIALS),
    "direction": list(DIRECTIONS),
    "ball": [False, True],
}


@dataclass
class Caption:
    """A text, and which attributes it says: those of its subject, or None."""

    concepts: list[str]
    said: dict[str, str | bool | None]


def describe(subject: Subject, rng: np.random.Generator) -> Caption:
    """A random caption that is true of a subject, and says more or less of it."""
    kind, mono = KINDS[subject.kind], subject.figure == subject.ground
    usual = (subject.figure, subject.ground) in kind.usual and rng.random() < 0.5
    kinds = rng.random() < (0.4 if subject.kind == "plain" else 0.94)
    figures = not usual and rng.random() < 0.93
    grounds = figures and not mono and rng.random() < 0.8
    said: dict[str, str | bool | None] = {
        "kind": subject.kind if kinds or not figures else None,
        "figure": subject.figure if figures else None,
        "ground": subject.ground if grounds else None,
        "scale": subject.scale if rng.random() < (0.1 if subject.scale == "medium" else 0.5) else None,
        "material": subject.material if subject.material and rng.random() < 0.7 else None,
        "direction": subject.direction if subject.direction and rng.random() < 0.7 else None,
        "ball": True if subject.ball and rng.random() < 0.4 else None,
    }
    return Caption(phrase(said, kind.equal, rng), said)


def phrase(said: dict[str, str | bool | None], equal: bool, rng: np.random.Generator) -> list[str]:
    """The concepts in an order in which people say them."""
    said = dict(said)
    if equal and said["figure"] and said["ground"] and rng.random() < 0.5:
        said["figure"], said["ground"] = said["ground"], said["figure"]
    figure, ground, pattern = (_words(said[key]) for key in ("figure", "ground", "kind"))
    size = [word for key in ("scale", "direction") for word in _words(said[key])]
    look, form = _words(said["material"]), rng.random()
    if rng.random() < 0.3:
        size, look = size + look, []
    if not ground:
        text = pattern + ["in"] + figure if pattern and figure and form < 0.05 else figure + pattern
        text = look + size + text
    elif form < (0.5 if equal else 0.12):
        text = look + size + figure + ["and"] + ground + pattern
    elif form < 0.6 and pattern:
        text = look + ground + ["with"] + size + figure + pattern
    elif form < 0.65 and pattern:
        text = look + size + pattern + ["in"] + figure + ["and"] + ground
    else:
        text = look + size + figure + pattern + ["on"] + ground
    ball = ["object"] if said["ball"] else []
    return ball + text if rng.random() < 0.5 else text + ball


def _words(value: str | bool | None) -> list[str]:
    return value.split() if isinstance(value, str) else []


def other(subject: Subject, rng: np.random.Generator) -> Subject:
    """A subject that differs in one thing: the places of its colours if it can be, or any attribute."""
    kind = KINDS[subject.kind]
    differ = subject.figure != subject.ground
    if differ and not kind.equal and subject.figure != COLOURFUL and rng.random() < 0.5:
        return replace(subject, figure=subject.ground, ground=subject.figure)
    keys = ["kind", "figure", "ground"] if differ else ["kind"]
    keys += [key for key in ("scale", "material", "direction") if getattr(subject, key) != ""]
    key = str(rng.choice(keys))
    values = [v for v in VALUES[key] if v not in ("", COLOURFUL, getattr(subject, key))]
    return replace(subject, **{key: str(rng.choice(values))})


def true_of(captions: list[Caption], subjects: list[Subject]) -> torch.Tensor:
    """(subjects, captions) bool: whether each caption is true of each subject."""
    numbers = {key: {value: number for number, value in enumerate(values)} for key, values in VALUES.items()}
    shown = {key: torch.tensor([numbers[key][getattr(s, key)] for s in subjects])[:, None] for key in VALUES}
    told = {
        key: torch.tensor([-1 if c.said[key] is None else numbers[key][c.said[key]] for c in captions])
        for key in VALUES
    }

    def agree(caption: str, subject: str) -> torch.Tensor:
        return (told[caption] == -1) | (told[caption] == shown[subject])

    same = agree("figure", "figure") & agree("ground", "ground")
    equal = torch.tensor([KINDS[s.kind].equal for s in subjects])[:, None]
    same |= equal & agree("figure", "ground") & agree("ground", "figure")
    for key in ("kind", "scale", "material", "direction", "ball"):
        same &= agree(key, key)
    return same
