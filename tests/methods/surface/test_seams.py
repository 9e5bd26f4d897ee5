"""The measure of seams tells seams from none, and a synthesis has none."""

from dataclasses import replace

import numpy as np
import pytest

from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.methods import surface
from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.fitting import with_layout
from mitex.methods.surface.seams import seam_ratio
from mitex.methods.surface.texels import Texels
from mitex.methods.surface.texture import SurfaceTexture
from mitex.training import resolve


@pytest.fixture(scope="module")
def blank():
    """A texture of nothing on a sphere of several charts."""
    mesh = with_layout(icosphere(12), resolve(PRESETS, None, None, ["resolution=96"]), False)
    assert mesh.uv is not None
    count = len(Texels.rasterize(mesh, mesh.uv, 96).index)
    about = {"resolution": 96, "frames": "smooth", "angle": 0.0}
    return SurfaceTexture(mesh, np.zeros((count, 3), np.float32), ("albedo",), about)


def test_a_smooth_function_of_space_has_no_seams(blank):
    waves = np.sin(9 * blank.texels.position + [0, 1, 2])
    found = seam_ratio(replace(blank, values=(0.5 + 0.5 * waves).astype(np.float32)))
    assert found == pytest.approx(1, abs=0.1)


def test_a_colour_for_each_chart_is_all_seams(blank):
    chart = blank.texels.chart[blank.texels.face]
    smooth = np.sin(blank.texels.position)
    colours = np.random.default_rng(0).random((chart.max() + 1, 3))
    assert seam_ratio(replace(blank, values=(0.1 * smooth + colours[chart]).astype(np.float32))) > 20


def test_nothing_to_compare(blank):
    assert np.isnan(seam_ratio(blank))


@pytest.mark.usefixtures("own_cache")
def test_a_synthesis_has_no_seams(tmp_path):
    """At most a tenth more across seams than elsewhere."""
    exemplar = Exemplar({"albedo": Exemplar.load("cobblestone").maps["albedo"]})
    settings = ["resolution=128", "exemplar_size=64", "steps=60", "milestones=40,50", "preview_every=0"]
    made = surface.fit(exemplar, icosphere(12), tmp_path / "run", overrides=settings, quiet=True)
    assert seam_ratio(made) < 1.1
