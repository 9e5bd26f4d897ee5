"""The script remakes what is in the package."""

import sys
from importlib import import_module
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

ROOT = Path(__file__).parents[2]


# One of each file of materials; the others, which are made of the same parts, take half a minute.
OTHERS = ("bricks", "knit", "lava", "leather", "scales")


@pytest.mark.parametrize(
    "name",
    [
        *("cobblestone", "hexagons", "planks", "rust", "wicker"),
        *(pytest.param(name, marks=pytest.mark.slow) for name in OTHERS),
    ],
)
def test_the_package_holds_what_the_script_makes(name, monkeypatch):
    monkeypatch.syspath_prepend(str(ROOT / "tools"))
    monkeypatch.delitem(sys.modules, "make_exemplars", raising=False)

    for key, array in import_module("make_exemplars").make(name).items():
        stored = np.asarray(Image.open(ROOT / "mitex" / "data" / "exemplars" / name / f"{key}.png"))
        # Another machine may round a few samples otherwise.
        assert (np.abs(stored.astype(int) - array.squeeze().astype(int)) > 2).mean() < 1e-3, key
