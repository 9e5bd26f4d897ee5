"""Seeded damage of files."""

from __future__ import annotations

import re

import numpy as np

# What a number or a word of a text may be replaced by.
NUMBERS = [b"nan", b"inf", b"-inf", b"1e999", b"-1", b"0", b"2147483648", b"9" * 30, b"1e30", b"0.5", b"true"]
WORDS = [b"null", b"[]", b"{}", b'""', b"[" * 5000, b"-", b"\xff\xfe", b"~nosuchuser/x", b"x" * 300, b"\0"]
NUMBER = re.compile(rb"-?\d+(?:\.\d+)?(?:e[-+]?\d+)?")
TOKEN = re.compile(rb'"[^"]*"|[A-Za-z_]\w*|-?\d[\w.+-]*|[\[\]{}:,=]')


def mutated(data: bytes, rng: np.random.Generator) -> bytes:
    """The data with one to three changes of any kind, which the generator draws."""
    for _ in range(rng.choice([1, 1, 1, 2, 3])):
        data = KINDS[rng.integers(len(KINDS))](data, rng)
    return data


def _span(data: bytes, rng: np.random.Generator) -> tuple[int, int]:
    start = int(rng.integers(len(data) + 1))
    return start, min(len(data), start + int(2 ** rng.uniform(0, 10)))


def _cut(data: bytes, rng: np.random.Generator) -> bytes:
    return data[: rng.integers(len(data) + 1)]


def _drop(data: bytes, rng: np.random.Generator) -> bytes:
    start, end = _span(data, rng)
    return data[:start] + data[end:]


def _repeat(data: bytes, rng: np.random.Generator) -> bytes:
    start, end = _span(data, rng)
    return data[:end] + data[start:]


def _bytes(data: bytes, rng: np.random.Generator) -> bytes:
    """Random bytes at random places, of which half are near the beginning, where headers are."""
    changed = bytearray(data)
    for _ in range(rng.integers(1, 9) if data else 0):
        most = len(data) if rng.random() < 0.5 else min(len(data), 512)
        changed[rng.integers(most)] = int(rng.choice([0, 1, 127, 128, 255, int(rng.integers(256))]))
    return bytes(changed)


def _number(data: bytes, rng: np.random.Generator) -> bytes:
    return _replaced(data, NUMBER, NUMBERS, rng)


def _word(data: bytes, rng: np.random.Generator) -> bytes:
    return _replaced(data, TOKEN, NUMBERS + WORDS, rng)


def _replaced(
    data: bytes, pattern: re.Pattern[bytes], others: list[bytes], rng: np.random.Generator
) -> bytes:
    """One match of a pattern among the 400 after a random place, half of which are near the beginning."""
    first = int(rng.integers(len(data) + 1)) if rng.random() < 0.5 else 0
    matches = [match for _, match in zip(range(400), pattern.finditer(data, first), strict=False)]
    if not matches:
        return data
    match = matches[rng.integers(len(matches))]
    return data[: match.start()] + others[rng.integers(len(others))] + data[match.end() :]


KINDS = (_cut, _drop, _repeat, _bytes, _number, _word, _word)
