"""The cache keeps to its limit, and what is cleared is what Mitex can make again."""

import os
from pathlib import Path

import numpy as np
import pytest

from mitex.cache import cached, content_key
from mitex.cache_entries import VARIABLE, clear, limit, results, unfinished
from mitex.errors import ConfigError

KB = 1000


@pytest.fixture(autouse=True)
def folder(tmp_path, monkeypatch) -> Path:
    """The cache, empty."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    monkeypatch.delenv(VARIABLE, raising=False)
    return tmp_path / "mitex"


def read(place: Path) -> bytes:
    return (place / "data").read_bytes()


def write(place: Path, data: bytes) -> None:
    (place / "data").write_bytes(data)


def keep(place: Path) -> bytes:
    """Asks for a result of a kilobyte."""
    return cached(place, lambda: bytes(KB), read, write)


def age(place: Path, hours: float) -> None:
    when = os.stat(place).st_mtime - 3600 * hours
    os.utime(place, (when, when))


def places(folder: Path, count: int, kind: str = "surface") -> list[Path]:
    """Results, the first of which is the oldest."""
    places = [folder / kind / content_key(k) for k in range(count)]
    for k, place in enumerate(places):
        keep(place)
        age(place, 10 - k)
    return places


def test_what_was_not_used_for_longest_goes_first(folder, monkeypatch):
    first, second, third = places(folder, 3)
    monkeypatch.setenv(VARIABLE, "3.5e-6")
    keep(first)  # read again
    fourth = folder / "nerf" / content_key("fourth")
    keep(fourth)
    assert {entry.place for entry in results()} == {third, first, fourth} and not second.exists()


def test_the_newest_stays_even_if_it_is_larger_than_the_limit(folder, monkeypatch):
    monkeypatch.setenv(VARIABLE, "0")
    *_, last = places(folder, 3)
    size = sum(file.stat().st_size for file in last.iterdir())  # with the list of hashes
    assert [(entry.place, entry.size) for entry in results()] == [(last, size)] and KB < size < 2 * KB
    assert keep(last) == bytes(KB)


def test_clearing_keeps_what_is_the_users_or_under_way(folder):
    kept = [folder / "weights" / "vgg19.pth", folder / "llvm.json", folder / "nerf" / f"{'b' * 32}.run" / "x"]
    left = folder / "nerf" / f"{'a' * 32}.run"
    for file in [*kept, left / "checkpoint.safetensors"]:
        file.parent.mkdir(parents=True, exist_ok=True)
        file.write_bytes(bytes(10))
    age(left, 2)
    before = places(folder, 2)
    assert [entry.place for entry in unfinished()] == [left]
    assert {entry.place for entry in clear()} == {*before, left}
    assert {path for path in folder.rglob("*") if path.is_file()} == set(kept)
    assert results() == [] and not left.exists()


def test_without_a_cache_there_is_nothing(folder):
    assert results() == clear() == [] and not folder.exists()


@pytest.mark.parametrize(("text", "size"), [("0.5", 5e8), ("", 2e9), ("0", 0.0), ("inf", np.inf)])
def test_the_limit(monkeypatch, text, size):
    monkeypatch.setenv(VARIABLE, text)
    assert limit() == size


@pytest.mark.parametrize("text", ["-1", "much", "nan", "2 GB"])
def test_a_limit_that_is_none_is_said_before_the_work(folder, monkeypatch, text):
    monkeypatch.setenv(VARIABLE, text)
    with pytest.raises(ConfigError, match=VARIABLE):
        cached(folder / "x" / "y", pytest.fail, read, write)
