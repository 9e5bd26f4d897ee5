"""What `--settings` shows of a preset is what is in it."""

from dataclasses import astuple

import pytest

from mitex.methods.registry import methods
from mitex.training.values import number_text

PRESETS = {f"{m.name} {name}": c for m in methods().values() for name, c in m.load_presets().items()}


@pytest.mark.parametrize("name", PRESETS)
def test_numbers_have_six_digits_at_most(name):
    values = astuple(PRESETS[name])
    numbers = [n for v in values for n in (v if isinstance(v, tuple) else (v,)) if isinstance(n, float)]
    assert [n for n in numbers if float(number_text(n)) != n] == []
