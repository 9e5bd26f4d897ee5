"""`mitex cache`."""

import pytest

from mitex.cli import main
from mitex.cli.cache import size_text


@pytest.fixture
def folder(tmp_path, monkeypatch):
    """A cache with three results."""
    monkeypatch.setenv("XDG_CACHE_HOME", str(tmp_path))
    for kind, letter, size in (("surface", "a", 2_500_000), ("surface", "b", 1000), ("nerf", "c", 500)):
        place = tmp_path / "mitex" / kind / (letter * 32)
        place.mkdir(parents=True)
        (place / "data").write_bytes(bytes(size))
    return tmp_path / "mitex"


def test_it_shows_place_number_and_size(folder, capsys, monkeypatch):
    monkeypatch.setenv("MITEX_CACHE_GB", "0.25")
    assert main(["cache"]) == 0
    assert capsys.readouterr().out.splitlines() == [
        f"{folder}: 3 entries, 2.5 MB; at most 250 MB",
        "  nerf       1 entry, 0.5 KB",
        "  surface    2 entries, 2.5 MB",
    ]


def test_clearing(folder, capsys):
    (folder / "llvm.json").touch()
    assert main(["cache", "--clear"]) == 0
    assert capsys.readouterr().out == f"removed 3 entries, 2.5 MB from {folder}\n"
    assert [path.name for path in folder.rglob("*") if path.is_file()] == ["llvm.json"]


def test_a_limit_that_is_none(folder, capsys, monkeypatch):
    monkeypatch.setenv("MITEX_CACHE_GB", "much")
    assert main(["cache"]) == 2
    message = "error: MITEX_CACHE_GB is 'much'; set it to the gigabytes that the cache may take\n"
    assert capsys.readouterr() == ("", message)


@pytest.mark.parametrize(
    ("size", "text"),
    [(0, "0 KB"), (1234, "1.23 KB"), (999_000, "999 KB"), (999_990, "1 MB"), (2.5e9, "2.5 GB")],
)
def test_sizes(size, text):
    assert size_text(size) == text
