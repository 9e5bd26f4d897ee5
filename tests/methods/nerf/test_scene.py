"""The example script with a captured texture, an automaton's mesh and a ball of glass."""

from __future__ import annotations

import numpy as np
import pytest

from mitex.images import read_image
from mitex.mesh import embedded, icosphere
from tests.methods.fits import few_patches
from tests.scenes.test_scripts import load


@pytest.mark.usefixtures("own_cache")
def test_all_three_are_in_the_picture(run, tmp_path, monkeypatch):
    """With a ball of cells in place of the octopus, which would be subdivided."""
    script = load("shell_texture")
    few_patches(monkeypatch)
    monkeypatch.setattr(script, "embedded", lambda name: embedded(name) if name == "vase" else icosphere(30))
    script.main(str(tmp_path / "shell.png"), str(run), size=128, resolution=64, spp=2)
    picture = read_image(tmp_path / "shell.png")
    assert picture.shape == (64, 96, 3)
    texture, glass, mesh = picture[22:42, 16:34], picture[42:54, 44:58], picture[22:42, 62:82]
    floor = picture[-6:].mean((0, 1))
    for part in (texture, mesh):
        assert part.std() > 0.05 and np.abs(part.mean((0, 1)) - floor).max() > 0.1
    assert glass.std() > 0.05
