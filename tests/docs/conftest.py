"""Fixtures of the tests of pages and site."""

from importlib import import_module
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]


@pytest.fixture
def site_module(monkeypatch):
    """A module of docs/site by its name."""
    monkeypatch.syspath_prepend(str(ROOT / "docs" / "site"))
    return import_module
