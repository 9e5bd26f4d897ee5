"""The measure of seams tells seams from none, and a synthesis has none."""

from dataclasses import replace

import numpy as np
import pytest

from mitex.exemplar import Exemplar
from mitex.mesh import icosphere
from mitex.methods import surface
from mitex.methods.layout import with_layout
from mitex.methods.surface.config import PRESETS
from mitex.methods.surface.domain import SurfaceDomain
from mitex.methods.surface.seams import seam_ratio
from mitex.methods.surface.texture import SurfaceTexture
from mitex.training import resolve


@pytest.fixture(scope="module")
def blank():
    """A texture of nothing on a sphere of several charts."""
    config = resolve(PRESETS, None, None, ["resolution=96"])
    domain = SurfaceDomain.of(with_layout(icosphere(12), config.resolution), config)
    return SurfaceTexture(domain, np.zeros((len(domain.texels.index), 3), np.float32), ("albedo",))


def test_a_smooth_function_of_space_has_no_seams(blank):
    waves = np.sin(9 * blank.domain.texels.position + [0, 1, 2])
    ratio = seam_ratio(replace(blank, values=(0.5 + 0.5 * waves).astype(np.float32)))
    assert ratio == pytest.approx(1, abs=0.1)


def test_a_colour_for_each_chart_is_all_seams(blank):
    chart = blank.domain.texels.chart[blank.domain.texels.face]
    smooth = np.sin(blank.domain.texels.position)
    colours = np.random.default_rng(0).random((chart.max() + 1, 3))
    assert seam_ratio(replace(blank, values=(0.1 * smooth + colours[chart]).astype(np.float32))) > 20


def test_nothing_to_compare(blank):
    assert np.isnan(seam_ratio(blank))


@pytest.mark.usefixtures("own_cache")
def test_a_synthesis_has_no_seams(tmp_path):
    """At most a tenth more across seams than elsewhere."""
    exemplar = Exemplar({"albedo": Exemplar.load("cobblestone").maps["albedo"]})
    settings = ["resolution=128", "exemplar_size=64", "steps=60", "milestones=40,50", "preview_every=0"]
    texture = surface.fit(exemplar, icosphere(12), tmp_path / "run", set=settings)
    assert seam_ratio(texture) < 1.1
