"""Packages that are not installed are named, with the extra that brings them."""

import json
import sys

import pytest

from mitex.errors import MissingPackage
from mitex.optional import optional


def test_a_module_that_is_there():
    assert optional("json", "text") is json


def test_what_is_missing_is_named(monkeypatch, tmp_path):
    """Also where a module of ours needs it."""
    (tmp_path / "needing.py").write_text("import absent\n")
    monkeypatch.syspath_prepend(tmp_path)
    monkeypatch.setitem(sys.modules, "absent", None)
    for module in ("absent", "needing"):
        with pytest.raises(MissingPackage, match=r"absent.*; run `pip install 'mitex\[text\]'`"):
            optional(module, "text")
